#pragma once
// A root of its own for one process tree: the system's programs and libraries, the given folder read-only, the output
// folder, nothing else. Linux namespaces (user, mount, process, network, IPC); no privileges needed where the kernel
// lets users make namespaces. Inside, no path leads to the rest of the disk, /proc shows only the process's own tree,
// and there is no network.
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace bevel::proof {

namespace fs = std::filesystem;

struct SandboxView {
  fs::path program;                // bound at its own path, with the libraries it needs
  fs::path given;                  // seen as /case, read-only
  fs::path output;                 // seen as /out
  std::vector<fs::path> readable;  // folders seen at their own paths, read-only
};

// Everything that the child needs, made before the fork: between fork and exec nothing may allocate.
class SandboxPlan {
 public:
  // `secret` must not be inside anything that is seen: throws std::runtime_error naming both otherwise, or where
  // `program` or a folder does not exist. `root` is an empty folder to build in.
  SandboxPlan(const SandboxView& view, const fs::path& secret, const fs::path& root);

  // In the child: enters the namespaces and the new root, forks, and returns in the grandchild, which is to exec; the
  // process in between ends with the grandchild's status. A step that fails is reported as bytes on `fault_pipe` and
  // ends the child.
  void enter(int fault_pipe) const;
  // Reads what enter() reported: "" if nothing.
  static std::string fault(int fault_pipe);

 private:
  struct Bind {
    std::string source;
    std::string target;
    bool folder;
    bool writable;
    unsigned long keep_flags;  // of the source's file system; a user namespace may not drop them
  };
  struct Link {
    std::string target;
    std::string path;
  };
  void add(const fs::path& source, const fs::path& inside, bool writable);
  void add_folders(const fs::path& inside);
  void build_root(int fault_pipe) const;
  void leave_old_root(int fault_pipe) const;

  std::string root_;
  std::string old_root_;
  std::string proc_;
  std::string uid_map_;
  std::string gid_map_;
  std::vector<std::string> folders_;
  std::vector<Bind> binds_;
  std::vector<Link> links_;
};

// Libraries outside the system's folders that the dynamic linker would load for it; none for a script.
std::vector<fs::path> libraries_of(const fs::path& program);

}  // namespace bevel::proof
