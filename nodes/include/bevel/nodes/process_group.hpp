// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Child processes that are started and ended together.
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace bevel::nodes {

/// Starts child processes and ends them in reverse order. The destructor ends those that still run.
class ProcessGroup {
 public:
  ProcessGroup() = default;
  ~ProcessGroup();
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;

  /// Starts a process.
  /// @param name     name for messages
  /// @param command  program and arguments; not empty
  /// @param log_path file for its output
  /// @throws IoError if it cannot be started
  void start(const std::string& name, const std::vector<std::string>& command, const std::string& log_path);
  /// Returns the name of a process that has ended and how it ended, once each.
  /// @return text such as "bevel-rig: exit status 1"; empty if all processes run
  std::optional<std::string> first_death();
  /// Ends all processes in reverse order of start: SIGTERM, then SIGKILL after 1 s.
  /// @return true if no process needed SIGKILL
  bool stop_all();

 private:
  struct Child {
    std::string name;
    pid_t pid;
  };
  std::vector<Child> children_;
};

}  // namespace bevel::nodes
