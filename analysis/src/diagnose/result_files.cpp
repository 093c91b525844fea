// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/result_files.hpp>

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>

#include <bevel/error.hpp>
#include <bevel/io/result_file.hpp>

namespace bevel::analysis {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw IoError(path.string() + ": " + what + ": " + std::strerror(errno));
}

// What the handler says; made beforehand, a handler may not allocate.
std::array<char, 160> parting_words{};
std::string program_name;

void say_on_signal(const std::string& what) {
  parting_words = {};
  const std::string words = "\n" + program_name + ": stopped; " + what + "\n";
  words.copy(parting_words.data(), parting_words.size() - 1);
}

extern "C" void end_now(int) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, parting_words.data(), std::strlen(parting_words.data()));
  ::_exit(1);
}

// Signals wait for as long as this lives. Results are written by the main thread after the others have ended.
class SignalsWait {
 public:
  SignalsWait() {
    sigset_t both;
    sigemptyset(&both);
    sigaddset(&both, SIGINT);
    sigaddset(&both, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &both, &before_);
  }
  ~SignalsWait() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

void check_writable(const fs::path& folder) {
  fs::path there = folder.lexically_normal();
  std::error_code ignored;
  while (!there.empty() && !fs::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
  if (there.empty()) there = ".";
  if (!fs::is_directory(there, ignored)) {
    errno = ENOTDIR;
    fail(folder, "cannot hold the results; " + there.string());
  }
  if (::access(there.c_str(), W_OK | X_OK) != 0) fail(folder, "no file can be made in " + there.string());
}

void write_together(const fs::path& folder, const std::vector<ResultFile>& files) {
  const SignalsWait wait;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be made: " + error.message());
  std::vector<io::PendingFile> pending;
  pending.reserve(files.size());
  for (const auto& file : files) {
    if (fs::is_directory(folder / file.name)) {
      errno = EISDIR;
      fail(folder / file.name, "cannot be replaced");
    }
    if (file.text) pending.emplace_back((folder / file.name).string(), *file.text);
  }
  if (!files.empty()) fs::remove(folder / files.back().name);
  for (const auto& file : files)
    if (!file.text) fs::remove(folder / file.name);
  for (auto& one : pending) one.take_place();
  say_on_signal("the results had been written");
}

void end_on_signals(const char* program) {
  program_name = program;
  say_on_signal("nothing was written");
  struct sigaction action {};
  action.sa_handler = end_now;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

}  // namespace bevel::analysis
