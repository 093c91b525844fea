// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Common parts of the main functions: signals, real-time scheduling, the periodic loop.
#include <atomic>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include <bevel/nodes/clock_watch.hpp>

namespace bevel::nodes {

/// Reads both clocks.
/// @return present time
Now now();

/// Installs handlers of SIGINT and SIGTERM, after which stop_requested() returns true. SIGPIPE and SIGXFSZ are ignored.
void catch_signals();
/// @return true after SIGINT or SIGTERM, or after the parent of end_with() has ended
bool stop_requested();

/// Requests SIGTERM from the kernel when the parent process ends, in whatever manner. If it has ended already, a stop
/// is requested immediately.
/// @param parent process id of the parent
void end_with(int parent);

/// Requests SCHED_FIFO for this thread and those that it starts later, and locks the memory.
/// @param priority priority of SCHED_FIFO
/// @return "", or what was rejected and why; the loop runs in any case
std::string try_realtime(int priority);

/// A periodic loop.
struct Loop {
  double period_s = 0.01;                               ///< period, s
  std::function<void(const Now&)> tell;                 ///< called with the time before messages are handled
  std::function<bool(const Now&, double late_s)> step;  ///< called every period with its delay, s; false ends the loop
  /// Returns another file descriptor to wait for, or -1 for none at present; empty: none.
  std::function<int()> other_fd{};
  /// Called when that file descriptor is readable.
  std::function<void(const Now&)> on_other{};
};
/// Calls loop.step every period until a stop is requested or it returns false, and handles LCM messages as they arrive
/// in between. After a stall the missed periods are skipped.
/// @param lcm  LCM
/// @param loop loop
void run_periodic(lcm::LCM& lcm, const Loop& loop);
/// Runs a loop like run_periodic(), regardless of a requested stop, for the remaining work of a process that ends.
/// @param lcm       LCM
/// @param loop      loop
/// @param longest_s longest duration, s
void run_to_end(lcm::LCM& lcm, const Loop& loop, double longest_s);
/// Runs run_periodic(), then run_to_end(), also if the first throws; its exception is rethrown at the end. So no axis
/// keeps moving unattended.
/// @param lcm        LCM
/// @param loop       loop of the normal operation
/// @param before_end called between the two loops
/// @param end        loop until the end
/// @param longest_s  longest duration of the second loop, s
void run_with_end(lcm::LCM& lcm, const Loop& loop, const std::function<void()>& before_end, const Loop& end,
                  double longest_s);

/// Timing of the loop on this thread. One process has one loop, and its status is reported from within.
struct LoopTimes {
  double late_max_s = 0;      ///< largest delay of a step since the last take_loop_times(), s
  double run_max_s = 0;       ///< longest step or handling of a message since the last take_loop_times(), s
  std::int64_t overruns = 0;  ///< steps and handlings longer than the period since the start
};
/// Returns the timing of run_periodic() on this thread, up to the previous step, and resets both maxima.
/// @return timing; zeros without a loop
LoopTimes take_loop_times();

/// Handles the messages that have arrived, without waiting.
/// @param lcm LCM
void pump(lcm::LCM& lcm);

}  // namespace bevel::nodes
