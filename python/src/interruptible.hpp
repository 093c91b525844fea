// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Long computations off the interpreter's thread, so that Ctrl-C and progress callbacks work.
#include <nanobind/nanobind.h>

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace bevel::python {

/// Thrown inside abandoned work to end it.
class Cancelled : public std::exception {};

/// One computation: its progress, its end, and the request to end it.
class Task {
 public:
  /// Queues a line of progress.
  /// @throws Cancelled after cancel()
  void report(const std::string& text);

  /// Requests that the work ends at its next report().
  void cancel();

  /// Marks the work as ended, with what it threw, if anything.
  void finish(std::exception_ptr thrown);

  /// Waits for a line of progress or for the end, at most 50 ms.
  /// @return whether the work has ended and every line has been taken
  bool wait(std::optional<std::string>& line);

  /// Rethrows what the work threw.
  void rethrow() const;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> lines_;
  bool cancelled_ = false, finished_ = false;
  std::exception_ptr thrown_;
};

/// Runs \p work on a thread, with the GIL released, and waits for it. The calling thread checks for signals every 50 ms
/// and calls \p progress with each line.
///
/// An exception of the signal handler (KeyboardInterrupt) or of \p progress is raised at once. The work then ends at
/// its next report, or when it is done; the interpreter waits for it at its exit.
/// @param progress a callable that takes a string, or None
void run_interruptible(const std::shared_ptr<Task>& task, std::function<void(Task&)> work, nanobind::object progress);

/// run_interruptible() with a result. \p work must own what it uses: it may outlive the call.
template <class Work>
auto compute_interruptible(Work work, nanobind::object progress) {
  using Result = decltype(work(std::declval<Task&>()));
  const auto task = std::make_shared<Task>();
  const auto result = std::make_shared<std::optional<Result>>();
  run_interruptible(
      task, [result, work = std::move(work)](Task& self) { result->emplace(work(self)); }, std::move(progress));
  return std::move(**result);
}

}  // namespace bevel::python
