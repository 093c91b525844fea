// SPDX-License-Identifier: MIT
#include "interruptible.hpp"

#include <nanobind/stl/string.h>

#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include "module.hpp"

namespace bevel::python {
namespace nb = nanobind;
namespace {

constexpr auto kPoll = std::chrono::milliseconds(50);

// Threads of abandoned work. Guarded by the GIL.
std::vector<std::thread>& abandoned() {
  static std::vector<std::thread> threads;
  return threads;
}

void wait_for_abandoned() {
  std::vector<std::thread> threads = std::exchange(abandoned(), {});
  const nb::gil_scoped_release release;
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

void Task::report(const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (cancelled_) throw Cancelled();
  if (text.empty()) return;
  lines_.push_back(text);
  changed_.notify_one();
}

void Task::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
}

void Task::finish(std::exception_ptr thrown) {
  const std::lock_guard lock(mutex_);
  thrown_ = std::move(thrown);
  finished_ = true;
  changed_.notify_one();
}

bool Task::wait(std::optional<std::string>& line) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kPoll, [&] { return finished_ || !lines_.empty(); });
  line.reset();
  if (!lines_.empty()) {
    line = std::move(lines_.front());
    lines_.pop_front();
    return false;
  }
  return finished_;
}

void Task::rethrow() const {
  if (thrown_) std::rethrow_exception(thrown_);
}

void run_interruptible(const std::shared_ptr<Task>& task, std::function<void(Task&)> work, nb::object progress) {
  std::thread thread([task, work = std::move(work)] {
    std::exception_ptr thrown;
    try {
      work(*task);
    } catch (...) {
      thrown = std::current_exception();
    }
    task->finish(thrown);
  });
  try {
    for (bool ended = false; !ended;) {
      std::optional<std::string> line;
      {
        const nb::gil_scoped_release release;
        ended = task->wait(line);
      }
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
      if (line && !progress.is_none()) progress(*line);
    }
  } catch (...) {
    task->cancel();
    abandoned().push_back(std::move(thread));
    throw;
  }
  thread.join();
  task->rethrow();
}

void bind_interruptible(nb::module_&) {
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(&wait_for_abandoned));
}

}  // namespace bevel::python
