#pragma once
// What every main needs: one of it on this machine, a clean end on Ctrl-C, and its loop.
#include <atomic>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <string>

namespace bevel::nodes {

// Both clocks at one instant. Loops run on the steady clock; utime only stamps.
struct Now {
  std::int64_t ns = 0;     // steady
  std::int64_t utime = 0;  // us since the epoch
};
Now now();

// Set by SIGINT and SIGTERM once catch_signals() was called.
void catch_signals();
bool stop_requested();

// Refuses a second process of this name in the same network namespace (where it would share the LCM channels); throws
// std::runtime_error. The name is held until the process ends, however it ends.
void claim_name(const std::string& name);

// SCHED_FIFO and locked memory; an empty string, or why it was refused (the loop runs all the same).
std::string try_realtime(int priority);

// Calls step(now, late_s) every period_s until a stop is requested or step returns false, handling LCM messages as they
// arrive in between. After a stall the missed periods are skipped, not caught up.
void run_periodic(lcm::LCM& lcm, double period_s, const std::function<bool(const Now&, double late_s)>& step);

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
