// SPDX-License-Identifier: MIT
#pragma once
// Child processes that are started together and end together.
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace bevel::nodes {

class ProcessGroup {
 public:
  ProcessGroup() = default;
  ~ProcessGroup();  // ends whatever still runs
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;

  // Throws IoError if it cannot be started. Its output goes to `log_path`.
  void start(const std::string& name, const std::vector<std::string>& command, const std::string& log_path);
  // Name and how it ended of a process that is no longer there, if any: "bevel-rig: exit status 1".
  std::optional<std::string> first_death();
  // SIGTERM, a second of grace, SIGKILL; by id, in reverse order of start. True if none had to be killed.
  bool stop_all();

 private:
  struct Child {
    std::string name;
    pid_t pid;
  };
  std::vector<Child> children_;
};

}  // namespace bevel::nodes
