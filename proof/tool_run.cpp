#include "proof/tool_run.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <stdexcept>

namespace bevel::proof {
namespace {

// An empty folder that goes with its owner.
class StagingFolder {
 public:
  StagingFolder() {
    std::string pattern = (fs::temp_directory_path() / "bevel-blindtrial-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error(pattern + ": cannot be made");
    path_ = pattern;
  }
  ~StagingFolder() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::vector<std::string> command_of(const ToolRun& run) {
  const fs::path given = run.sealed ? fs::path("/case") : run.given;
  const auto logs_in = [&](const fs::path& folder) {
    std::vector<std::string> logs;
    for (const auto& entry : fs::directory_iterator(run.given / folder))
      if (entry.path().extension() == ".lcm") logs.push_back((given / folder / entry.path().filename()).string());
    std::ranges::sort(logs);
    return logs;
  };
  std::vector<std::string> command{run.program.string(), "--model", (given / "model.toml").string(), "--out",
                                   run.sealed ? "/out" : run.output.string()};
  const auto add = [&](const std::vector<std::string>& words) {
    command.insert(command.end(), words.begin(), words.end());
  };
  if (fs::is_directory(run.given / "before")) {
    add({"--baseline"}), add(logs_in("before"));
    add({"--changed"}), add(logs_in("after"));
  } else {
    add(logs_in(""));
  }
  return command;
}

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> result;
  for (std::string& word : words) result.push_back(word.data());
  result.push_back(nullptr);
  return result;
}

// Grandchildren outside a process namespace are reached through the group.
void end_group(pid_t child) {
  ::kill(-child, SIGKILL);
  ::kill(child, SIGKILL);
}

ToolEnd wait_for(pid_t child, double limit_s, const std::atomic<int>& stop) {
  const auto start = std::chrono::steady_clock::now();
  ToolEnd end;
  int status = 0;
  bool killed = false;
  for (;;) {
    const pid_t done = ::waitpid(child, &status, WNOHANG);
    end.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (done == child) break;
    if (done < 0 && errno != EINTR) throw std::runtime_error(std::string("waitpid: ") + std::strerror(errno));
    if (!killed && (stop != 0 || end.seconds > limit_s)) {
      end.stopped = stop != 0;
      end.out_of_time = !end.stopped;
      end_group(child);
      killed = true;
    }
    ::poll(nullptr, 0, 10);
  }
  end_group(child);
  end.exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return end;
}

}  // namespace

ToolEnd run_tool(const ToolRun& run, const std::atomic<int>& stop) {
  if (::access(run.program.c_str(), X_OK) != 0)
    throw std::runtime_error(run.program.string() + ": " + std::strerror(errno) + " (the tool under test)");
  const StagingFolder staging;
  std::optional<SandboxPlan> plan;
  if (run.sealed)
    plan.emplace(SandboxView{run.program, run.given, run.output, run.readable}, run.secret, staging.path());
  std::vector<std::string> command = command_of(run);
  std::vector<std::string> environment{"PATH=/usr/local/bin:/usr/bin:/bin", "HOME=/tmp", "TMPDIR=/tmp", "LANG=C.UTF-8"};
  const auto arguments = pointers(command);
  const auto variables = pointers(environment);
  const std::string console = run.console.string();
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));

  const pid_t child = ::fork();
  if (child == 0) {  // until exec only calls that are safe in the child of a program with threads
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // NOLINT(cppcoreguidelines-pro-type-vararg)
    const int out = ::open(console.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);  // NOLINT(*-vararg)
    const int in = ::open("/dev/null", O_RDONLY | O_CLOEXEC);                                 // NOLINT(*-vararg)
    if (out < 0 || in < 0) ::_exit(127);
    ::dup2(in, 0);
    ::dup2(out, 1);
    ::dup2(out, 2);
    // No open file of this program may show the way to another folder.
    ::dup2(pipe[1], 3);
    ::close_range(4, ~0U, 0);
    ::fcntl(3, F_SETFD, FD_CLOEXEC);  // NOLINT(cppcoreguidelines-pro-type-vararg)
    if (plan) plan->enter(3);
    ::execve(arguments[0], arguments.data(), variables.data());
    ::_exit(127);
  }
  ::close(pipe[1]);
  if (child < 0) {
    ::close(pipe[0]);
    throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  }
  const ToolEnd end = wait_for(child, run.limit_s, stop);
  const std::string fault = SandboxPlan::fault(pipe[0]);
  ::close(pipe[0]);
  if (!fault.empty() && !end.stopped && !end.out_of_time)
    throw std::runtime_error("the tool cannot be sealed off (" + fault +
                             "); where the kernel has no user namespaces, --unsealed runs it without, and says so");
  return end;
}

}  // namespace bevel::proof
