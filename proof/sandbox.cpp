#include "proof/sandbox.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace bevel::proof {
namespace {

constexpr std::array<const char*, 4> kDevices{"/dev/null", "/dev/zero", "/dev/random", "/dev/urandom"};
constexpr std::array<const char*, 6> kSystem{"/usr", "/bin", "/sbin", "/lib", "/lib64", "/etc"};

struct Fault {
  int error;
  std::array<char, 60> step;
};

// Ends the child with a word to the parent. Only calls that are safe after a fork.
[[noreturn]] void give_up(int fault_pipe, const char* step) {
  Fault fault{errno, {}};
  std::strncpy(fault.step.data(), step, fault.step.size() - 1);
  if (::write(fault_pipe, &fault, sizeof fault) < 0) ::_exit(126);
  ::_exit(125);
}

void write_file(int fault_pipe, const char* path, const std::string& text) {
  const int file = ::open(path, O_WRONLY | O_CLOEXEC);  // NOLINT(cppcoreguidelines-pro-type-vararg)
  if (file < 0 || ::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    give_up(fault_pipe, path);
  ::close(file);
}

unsigned long kept_flags(const fs::path& source) {
  struct statvfs info {};
  if (::statvfs(source.c_str(), &info) != 0) throw std::runtime_error(source.string() + ": " + std::strerror(errno));
  unsigned long flags = 0;
  if (info.f_flag & ST_NOSUID) flags |= MS_NOSUID;
  if (info.f_flag & ST_NODEV) flags |= MS_NODEV;
  if (info.f_flag & ST_NOEXEC) flags |= MS_NOEXEC;
  if (info.f_flag & ST_NOATIME) flags |= MS_NOATIME;
  if (info.f_flag & ST_RELATIME) flags |= MS_RELATIME;
  return flags;
}

bool is_inside(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

// The process between the namespaces' maker and the tool: first of its process namespace, so that its end is the end of
// everything that the tool started.
[[noreturn]] void wait_as_init(pid_t tool) {
  int status = 0;
  while (::waitpid(tool, &status, 0) < 0 && errno == EINTR) {
  }
  ::_exit(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
}

}  // namespace

SandboxPlan::SandboxPlan(const SandboxView& view, const fs::path& secret, const fs::path& root)
    : root_(root.string()), old_root_((root / ".old").string()), proc_((root / "proc").string()) {
  uid_map_ = "0 " + std::to_string(::geteuid()) + " 1\n";
  gid_map_ = "0 " + std::to_string(::getegid()) + " 1\n";
  for (const char* folder : {"/.old", "/proc", "/tmp", "/dev"}) add_folders(folder);
  for (const char* path : kSystem) {
    if (!fs::exists(path)) continue;
    if (fs::is_symlink(path))
      links_.push_back({fs::read_symlink(path).string(), root_ + path});
    else
      add(path, path, false);
  }
  for (const char* device : kDevices) add(device, device, true);
  add(view.given, "/case", false);
  add(view.output, "/out", true);
  for (const fs::path& folder : view.readable) add(folder, folder, false);
  add(view.program, view.program, false);
  for (const fs::path& library : libraries_of(view.program)) add(library, library, false);

  const fs::path hidden = fs::weakly_canonical(secret);
  for (const Bind& bind : binds_)
    if (is_inside(hidden, fs::canonical(bind.source)))
      throw std::runtime_error(hidden.string() + ": the sealed truths lie inside " + bind.source +
                               ", which the tool under test can read; take another --out");
}

void SandboxPlan::add_folders(const fs::path& inside) {
  fs::path path = root_;
  for (const fs::path& part : inside.relative_path()) {
    path /= part;
    if (std::ranges::find(folders_, path.string()) == folders_.end()) folders_.push_back(path.string());
  }
}

void SandboxPlan::add(const fs::path& source, const fs::path& inside, bool writable) {
  if (!fs::exists(source)) throw std::runtime_error(source.string() + ": does not exist");
  const bool folder = fs::is_directory(source);
  add_folders(folder ? inside : inside.parent_path());
  binds_.push_back({source.string(), root_ + inside.string(), folder, writable, kept_flags(source)});
}

void SandboxPlan::build_root(int fault_pipe) const {
  if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) give_up(fault_pipe, "making mounts private");
  if (::mount("tmpfs", root_.c_str(), "tmpfs", MS_NOSUID, "mode=755") != 0) give_up(fault_pipe, "mounting a tmpfs");
  for (const std::string& folder : folders_)
    if (::mkdir(folder.c_str(), 0755) != 0 && errno != EEXIST) give_up(fault_pipe, folder.c_str());
  for (const Link& link : links_)
    if (::symlink(link.target.c_str(), link.path.c_str()) != 0) give_up(fault_pipe, link.path.c_str());
  for (const Bind& bind : binds_) {
    // What lies in a folder that is bound already has its place there, read-only.
    if (!bind.folder && ::access(bind.target.c_str(), F_OK) != 0) {
      const int file = ::open(bind.target.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);  // NOLINT(*-vararg)
      if (file < 0) give_up(fault_pipe, bind.target.c_str());
      ::close(file);
    }
    if (::mount(bind.source.c_str(), bind.target.c_str(), nullptr, MS_BIND | MS_REC, nullptr) != 0)
      give_up(fault_pipe, bind.source.c_str());
    if (!bind.writable && ::mount(nullptr, bind.target.c_str(), nullptr,
                                  MS_REMOUNT | MS_BIND | MS_RDONLY | bind.keep_flags, nullptr) != 0)
      give_up(fault_pipe, bind.target.c_str());
  }
}

void SandboxPlan::leave_old_root(int fault_pipe) const {
  // Mounted by a process of the new process namespace, it shows that namespace and no other.
  if (::mount("proc", proc_.c_str(), "proc", MS_NOSUID | MS_NODEV | MS_NOEXEC, nullptr) != 0)
    give_up(fault_pipe, "mounting /proc");
  if (::syscall(SYS_pivot_root, root_.c_str(), old_root_.c_str()) != 0) give_up(fault_pipe, "changing the root");
  if (::chdir("/") != 0) give_up(fault_pipe, "entering the new root");
  if (::umount2("/.old", MNT_DETACH) != 0) give_up(fault_pipe, "leaving the old root");
  if (::rmdir("/.old") != 0) give_up(fault_pipe, "removing the old root's place");
  if (::chdir("/out") != 0) give_up(fault_pipe, "entering the output folder");
}

void SandboxPlan::enter(int fault_pipe) const {
  const int spaces = CLONE_NEWUSER | CLONE_NEWNS | CLONE_NEWPID | CLONE_NEWNET | CLONE_NEWIPC;
  if (::unshare(spaces) != 0) give_up(fault_pipe, "making namespaces");
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // again: a change of credentials clears it  NOLINT(*-vararg)
  write_file(fault_pipe, "/proc/self/setgroups", "deny");
  write_file(fault_pipe, "/proc/self/uid_map", uid_map_);
  write_file(fault_pipe, "/proc/self/gid_map", gid_map_);
  build_root(fault_pipe);
  const pid_t init = ::fork();
  if (init < 0) give_up(fault_pipe, "forking");
  if (init > 0) wait_as_init(init);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // NOLINT(cppcoreguidelines-pro-type-vararg)
  leave_old_root(fault_pipe);
  const pid_t tool = ::fork();
  if (tool < 0) give_up(fault_pipe, "forking");
  if (tool > 0) {
    ::close(fault_pipe);
    wait_as_init(tool);
  }
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-vararg)
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) give_up(fault_pipe, "giving up privileges");
}

std::string SandboxPlan::fault(int fault_pipe) {
  Fault fault{};
  const ssize_t got = ::read(fault_pipe, &fault, sizeof fault);
  if (got != static_cast<ssize_t>(sizeof fault)) return "";
  return std::string(fault.step.data()) + ": " + std::strerror(fault.error);
}

std::vector<fs::path> libraries_of(const fs::path& program) {
  std::string quoted = program.string();
  for (std::size_t at = quoted.find('\''); at != std::string::npos; at = quoted.find('\'', at + 4))
    quoted.replace(at, 1, "'\\''");
  const std::string command = "ldd '" + quoted + "' 2>/dev/null";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) throw std::runtime_error("ldd cannot be started");
  std::vector<fs::path> libraries;
  std::array<char, 4096> line{};
  while (std::fgets(line.data(), line.size(), pipe.get()) != nullptr) {
    const std::string text = line.data();
    const std::size_t arrow = text.find("=> /");
    if (arrow == std::string::npos) continue;
    const fs::path path = text.substr(arrow + 3, text.find(' ', arrow + 3) - arrow - 3);
    const bool system = std::ranges::any_of(kSystem, [&](const char* folder) { return is_inside(path, folder); });
    if (!system) libraries.push_back(path);
  }
  return libraries;
}

}  // namespace bevel::proof
