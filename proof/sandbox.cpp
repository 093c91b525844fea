// SPDX-License-Identifier: MIT
#include "proof/sandbox.hpp"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <initializer_list>
#include <memory>
#include <utility>

#include <bevel/error.hpp>
#include "proof/libraries.hpp"

namespace bevel::proof {
namespace {

constexpr std::array<const char*, 6> kSystem{"/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64"};
// Files of /etc that the dynamic linker, interpreters, time and fonts need; the others describe this machine.
constexpr std::array<const char*, 9> kOfEtc{"/etc/ld.so.cache",  "/etc/ld.so.conf",    "/etc/ld.so.conf.d",
                                            "/etc/alternatives", "/etc/localtime",     "/etc/passwd",
                                            "/etc/group",        "/etc/nsswitch.conf", "/etc/fonts"};
// Files and folders of /proc that show the whole machine and not the processes of the sandbox.
constexpr std::array<const char*, 9> kHiddenFiles{"/proc/cmdline",     "/proc/kcore",      "/proc/keys",
                                                  "/proc/key-users",   "/proc/kallsyms",   "/proc/modules",
                                                  "/proc/sched_debug", "/proc/timer_list", "/proc/latency_stats"};
constexpr std::array<const char*, 4> kHiddenFolders{"/proc/acpi", "/proc/asound", "/proc/scsi", "/proc/fs"};

class Options {
 public:
  void add(std::initializer_list<std::string> words) {
    for (const std::string& word : words) {
      if (word.find('\0') != std::string::npos) throw IoError("a path has a zero byte");
      text_ += word + '\0';
    }
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

bool is_inside(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

void require_apart(const fs::path& source, const fs::path& hidden) {
  if (!fs::exists(source)) throw IoError(source.string() + ": does not exist");
  const fs::path there = fs::canonical(source);
  if (is_inside(hidden, there) || is_inside(there, hidden))
    throw IoError(hidden.string() + ": the sealed truths and " + there.string() +
                  ", which the tool under test can read, are not apart; take another --out");
}

/// Whether bubblewrap has --disable-userns, from version 0.8 on. Without it a tool can make a user namespace with
/// capabilities in it, in which the mounts of the sandbox stay locked.
bool disables_user_namespaces() {
  const std::string command = std::string(kBubblewrap) + " --version";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  int major = 0, minor = 0;
  if (!pipe || std::fscanf(pipe.get(), "bubblewrap %d.%d", &major, &minor) != 2) return false;
  return major > 0 || minor >= 8;
}

}  // namespace

std::string sandbox_options(const SandboxView& view, const fs::path& secret) {
  if (::access(kBubblewrap, X_OK) != 0)
    throw IoError(std::string(kBubblewrap) +
                  " is not there; install the package bubblewrap (tools/setup does), or give --unsealed, "
                  "which the result reports");
  const fs::path hidden = fs::weakly_canonical(secret);
  Options options;
  options.add({"--unshare-user", "--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts",
               "--unshare-cgroup-try", "--die-with-parent", "--new-session", "--cap-drop", "ALL", "--hostname",
               "case"});
  if (disables_user_namespaces()) options.add({"--disable-userns"});
  options.add({"--clearenv", "--setenv", "PATH", "/usr/local/bin:/usr/bin:/bin", "--setenv", "HOME", "/tmp", "--setenv",
               "TMPDIR", "/tmp", "--setenv", "LANG", "C.UTF-8"});
  for (const char* path : kSystem) {
    if (!fs::exists(path)) continue;
    if (fs::is_symlink(path)) {
      options.add({"--symlink", fs::read_symlink(path).string(), path});
      continue;
    }
    require_apart(path, hidden);
    options.add({"--ro-bind", path, path});
  }
  for (const char* path : kOfEtc) options.add({"--ro-bind-try", path, path});
  options.add({"--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp"});
  for (const char* path : kHiddenFiles)
    if (fs::exists(path)) options.add({"--ro-bind", "/dev/null", path});
  for (const char* path : kHiddenFolders)
    if (fs::exists(path)) options.add({"--tmpfs", path, "--remount-ro", path});
  options.add({"--ro-bind", view.given.string(), "/case", "--bind", view.output.string(), "/out"});
  std::vector<fs::path> readable = view.readable;
  readable.push_back(view.program);
  for (const fs::path& library : libraries_of(view.program)) readable.push_back(library);
  for (const fs::path& path : readable) {
    require_apart(path, hidden);
    options.add({"--ro-bind", path.string(), path.string()});
  }
  options.add({"--chdir", "/out", "--remount-ro", "/"});
  return options.take();
}

}  // namespace bevel::proof
