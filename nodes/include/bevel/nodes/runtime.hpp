// SPDX-License-Identifier: MIT
#pragma once
// What every main needs: one of it on this machine, a clean end on Ctrl-C, and its loop.
#include <atomic>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include <bevel/nodes/clock_watch.hpp>

namespace bevel::nodes {

Now now();

// Set by SIGINT and SIGTERM once catch_signals() was called.
void catch_signals();
bool stop_requested();

// Asks the kernel for SIGTERM when process `parent`, which started this one, is gone, however it goes; at once if it
// already is.
void end_with(int parent);

// SCHED_FIFO for this thread and those that it starts from here on, and locked memory; an empty string, or what of it
// was refused and why (the loop runs all the same).
std::string try_realtime(int priority);

struct Loop {
  double period_s = 0.01;
  std::function<void(const Now&)> tell;                 // the time, before messages are handled
  std::function<bool(const Now&, double late_s)> step;  // false ends the loop
  // Optional: something else to wait for beside messages, and what is done when it is readable. -1: nothing now.
  std::function<int()> other_fd{};
  std::function<void(const Now&)> on_other{};
};
// Calls step every period until a stop is requested or step returns false, handling LCM messages as they arrive in
// between. After a stall the missed periods are skipped, not caught up.
void run_periodic(lcm::LCM& lcm, const Loop& loop);
// The same whether or not a stop was requested, for at most so long: what a process still has to do before it ends.
void run_to_end(lcm::LCM& lcm, const Loop& loop, double longest_s);
// Both, also when the first ends by an exception, which is raised again at the end: nothing that moves is left alone.
void run_with_end(lcm::LCM& lcm, const Loop& loop, const std::function<void()>& before_end, const Loop& end,
                  double longest_s);

// How the loop on this thread keeps its time. One process has one loop, and its status is reported from within.
struct LoopTimes {
  double late_max_s = 0;      // latest start of a step, since the last taking
  double run_max_s = 0;       // longest step or handling of a message, since the last taking
  std::int64_t overruns = 0;  // of those longer than the period, since the start
};
// Of run_periodic() on this thread, up to the step before the one that asks; zeros without one. Both maxima begin anew.
LoopTimes take_loop_times();

// Handles what has arrived, without waiting.
void pump(lcm::LCM& lcm);

}  // namespace bevel::nodes
