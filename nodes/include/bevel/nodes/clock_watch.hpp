// SPDX-License-Identifier: MIT
#pragma once
// The two clocks of a process, and whether somebody has set the wall clock.
#include <cstdint>
#include <cstdlib>

namespace bevel::nodes {

// Both clocks at one instant. Loops, ages of what has arrived and silences run on the steady clock; utime stamps.
struct Now {
  std::int64_t ns = 0;     // steady
  std::int64_t utime = 0;  // us since the epoch
};

class ClockWatch {
 public:
  // By how much the wall clock was set since the last call, us; 0 while it runs as it should. Slewing, which time
  // services do at no more than 500 ppm, is followed.
  std::int64_t step_us(const Now& now) {
    const std::int64_t offset_us = now.utime - now.ns / 1000;
    const std::int64_t change_us = started_ ? offset_us - offset_us_ : 0;
    started_ = true;
    offset_us_ = offset_us;
    return std::abs(change_us) > kStep_us ? change_us : 0;
  }

 private:
  // Of what messages may be ahead: a smaller step does no harm that the bounds of age do not catch.
  static constexpr std::int64_t kStep_us = 20'000;
  bool started_ = false;
  std::int64_t offset_us_ = 0;
};

}  // namespace bevel::nodes
