// SPDX-License-Identifier: MIT
#include <bevel/nodes/process_group.hpp>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include <bevel/error.hpp>

extern char** environ;

namespace bevel::nodes {

ProcessGroup::~ProcessGroup() { stop_all(); }

void ProcessGroup::start(const std::string& name, const std::vector<std::string>& command,
                         const std::string& log_path) {
  std::vector<std::string> words = command;
  // However this process goes, its children hear of it and end in order.
  words.insert(words.end(), {"--end-with", std::to_string(getpid())});
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, log_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  // A process group of its own: Ctrl-C reaches only the parent, which then stops the children in order.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) throw IoError("cannot start " + command[0] + ": " + std::strerror(error));
  children_.push_back({name, pid});
}

std::optional<std::string> ProcessGroup::first_death() {
  for (auto child = children_.begin(); child != children_.end(); ++child) {
    int status = 0;
    if (waitpid(child->pid, &status, WNOHANG) != child->pid) continue;
    std::string how = "exit status " + std::to_string(WEXITSTATUS(status));
    if (WIFSIGNALED(status)) how = std::string("killed by ").append(strsignal(WTERMSIG(status)));
    const std::string name = child->name;
    children_.erase(child);
    return std::string(name).append(": ").append(how);
  }
  return std::nullopt;
}

bool ProcessGroup::stop_all() {
  bool clean = true;
  while (!children_.empty()) {
    const pid_t pid = children_.back().pid;
    kill(pid, SIGTERM);
    int waited_ms = 0;
    while (waitpid(pid, nullptr, WNOHANG) == 0) {
      if (waited_ms == 1000) {
        kill(pid, SIGKILL);
        clean = false;
      }
      usleep(10'000);
      waited_ms += 10;
    }
    children_.pop_back();
  }
  return clean;
}

}  // namespace bevel::nodes
