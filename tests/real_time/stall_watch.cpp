// SPDX-License-Identifier: MIT
// How long the processors of this machine stand still for who is ready to run: one thread on each wakes every 2 ms, and
// the longest it overslept, in ms, is in the file named, for as long as this runs. A test whose processes have
// deadlines of 80 ms says nothing about them on a machine that was away for as long.
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <thread>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) return std::fputs("usage: stall_watch FILE\n", stderr), 2;
  using Clock = std::chrono::steady_clock;
  constexpr auto kPeriod = std::chrono::milliseconds(2);
  std::atomic<long> longest_ms = 0;
  std::vector<std::jthread> threads;
  for (unsigned cpu = 0; cpu < std::max(1U, std::thread::hardware_concurrency()); ++cpu)
    threads.emplace_back([cpu, kPeriod, &longest_ms] {
      cpu_set_t one;
      CPU_ZERO(&one);
      CPU_SET(cpu, &one);
      sched_setaffinity(0, sizeof one, &one);  // where that is refused it wanders, and still measures
      for (;;) {
        const auto due = Clock::now() + kPeriod;
        std::this_thread::sleep_until(due);
        const long late_ms = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - due).count();
        if (late_ms > longest_ms) longest_ms = late_ms;
      }
    });
  for (long written_ms = -1;; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    const long now_ms = longest_ms;
    if (now_ms > written_ms) std::ofstream(argv[1]) << (written_ms = now_ms) << "\n";
  }
}
