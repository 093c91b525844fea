// SPDX-License-Identifier: MIT
#include "proof/tool_run.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
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
#include <system_error>

#include <bevel/error.hpp>

namespace bevel::proof {
namespace {

/// Folder with a random name, removed with this object. The mounts of the sandbox show its path inside, and not that of
/// the campaign, which may tell the trial or the seed.
class StagingFolder {
 public:
  StagingFolder() {
    std::string pattern = (fs::temp_directory_path() / "bevel-blindtrial-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw IoError(pattern + ": cannot be made");
    path_ = pattern;
  }
  ~StagingFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
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

/// Copies folders, regular files and symbolic links as such; leaves out everything else that a tool can make.
void copy_files(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to, error);
  for (fs::recursive_directory_iterator entry(from, fs::directory_options::skip_permission_denied, error), end;
       !error && entry != end; entry.increment(error)) {
    const fs::path target = to / entry->path().lexically_relative(from);
    std::error_code failed;
    const fs::file_status status = entry->symlink_status(failed);
    if (fs::is_directory(status))
      fs::create_directory(target, failed);
    else if (fs::is_symlink(status))
      fs::copy_symlink(entry->path(), target, failed);
    else if (fs::is_regular_file(status))
      fs::copy_file(entry->path(), target, fs::copy_options::overwrite_existing, failed);
    if (failed && failed != std::errc::permission_denied)
      throw IoError(target.string() + ": cannot be written: " + failed.message());
  }
}

/// File in memory with that text, to be read from its start.
int file_with(const std::string& text) {
  const int file = ::memfd_create("options", MFD_CLOEXEC);
  std::size_t done = 0;
  while (file >= 0 && done < text.size()) {
    const ssize_t size = ::write(file, text.data() + done, text.size() - done);
    if (size < 0 && errno != EINTR) break;
    if (size > 0) done += static_cast<std::size_t>(size);
  }
  if (file < 0 || done < text.size() || ::lseek(file, 0, SEEK_SET) != 0)
    throw IoError(std::string("the options of the sandbox cannot be stored: ") + std::strerror(errno));
  return file;
}

/// Everything that a status pipe holds once its writers have ended.
std::string text_in(int pipe) {
  std::string text;
  std::array<char, 512> bytes{};
  for (ssize_t size = 0; (size = ::read(pipe, bytes.data(), bytes.size())) > 0;)
    text.append(bytes.data(), static_cast<std::size_t>(size));
  return text;
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
    if (done < 0 && errno != EINTR) throw IoError(std::string("waitpid: ") + std::strerror(errno));
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
    throw IoError(run.program.string() + ": " + std::strerror(errno) + " (the tool under test)");
  const StagingFolder staging;
  const fs::path given = staging.path() / "case", output = staging.path() / "out";
  std::vector<std::string> command = command_of(run);
  // bubblewrap reads its options from descriptor 3 and reports on descriptor 4 that it has started the tool.
  int options = -1;
  if (run.sealed) {
    fs::create_directories(output);
    copy_files(run.given, given);
    options = file_with(sandbox_options({run.program, given, output, run.readable}, run.secret));
    command.insert(command.begin(), {kBubblewrap, "--args", "3", "--json-status-fd", "4", "--"});
  }
  std::vector<std::string> environment{"PATH=/usr/local/bin:/usr/bin:/bin", "HOME=/tmp", "TMPDIR=/tmp", "LANG=C.UTF-8"};
  const auto arguments = pointers(command);
  const auto variables = pointers(environment);
  const std::string console = run.console.string();
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw IoError(std::string("pipe: ") + std::strerror(errno));

  const pid_t child = ::fork();
  if (child == 0) {  // until exec only calls that are safe in the child of a program with threads
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // NOLINT(cppcoreguidelines-pro-type-vararg)
    const int out = ::open(console.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);  // NOLINT(*-vararg)
    const int in = ::open("/dev/null", O_RDONLY | O_CLOEXEC);                                 // NOLINT(*-vararg)
    if (out < 0 || in < 0) ::_exit(127);
    // Above the numbers that are assigned next, so that none of the copies is overwritten.
    constexpr int kAbove = 10;
    const int high_options = options < 0 ? -1 : ::fcntl(options, F_DUPFD_CLOEXEC, kAbove);  // NOLINT(*-vararg)
    const int high_status = ::fcntl(pipe[1], F_DUPFD_CLOEXEC, kAbove);                      // NOLINT(*-vararg)
    const int high_in = ::fcntl(in, F_DUPFD_CLOEXEC, kAbove);                               // NOLINT(*-vararg)
    const int high_out = ::fcntl(out, F_DUPFD_CLOEXEC, kAbove);                             // NOLINT(*-vararg)
    ::dup2(high_in, 0);
    ::dup2(high_out, 1);
    ::dup2(high_out, 2);
    if (high_options >= 0) {
      ::dup2(high_options, 3);
      ::dup2(high_status, 4);
    }
    // No open file of this program may show the way to another folder.
    ::close_range(high_options >= 0 ? 5 : 3, ~0U, 0);
    ::execve(arguments[0], arguments.data(), variables.data());
    ::_exit(127);
  }
  ::close(pipe[1]);
  if (options >= 0) ::close(options);
  if (child < 0) {
    ::close(pipe[0]);
    throw IoError(std::string("fork: ") + std::strerror(errno));
  }
  const ToolEnd end = wait_for(child, run.limit_s, stop);
  const std::string status = text_in(pipe[0]);
  ::close(pipe[0]);
  if (run.sealed && !end.stopped && !end.out_of_time && status.find("child-pid") == std::string::npos)
    throw IoError("the tool cannot be sealed off (" + console +
                  " has bubblewrap's message); where the kernel has no user namespaces, --unsealed runs it "
                  "without, and the result reports that");
  if (run.sealed) copy_files(output, run.output);
  return end;
}

}  // namespace bevel::proof
