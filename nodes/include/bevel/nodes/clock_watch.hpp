// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The steady clock and the wall clock of a process, and detection of a wall clock that was set.
#include <cstdint>
#include <cstdlib>

namespace bevel::nodes {

/// Both clocks at one time. Loops, ages and time-outs use the steady clock; messages are stamped with utime.
struct Now {
  std::int64_t ns = 0;     ///< steady clock, ns
  std::int64_t utime = 0;  ///< wall clock, us since the epoch
};

/// Detects steps of the wall clock.
class ClockWatch {
 public:
  /// Computes the step of the wall clock since the last call. Changes of at most 20 ms between two calls are tolerated,
  /// such as those of time services (at most 500 ppm).
  /// @param now present time
  /// @return step, us; 0 without a step
  std::int64_t step_us(const Now& now) {
    const std::int64_t offset_us = now.utime - now.ns / 1000;
    const std::int64_t change_us = started_ ? offset_us - offset_us_ : 0;
    started_ = true;
    offset_us_ = offset_us;
    return std::abs(change_us) > kStep_us ? change_us : 0;
  }

 private:
  // The limits of message age cover the effect of a smaller step.
  static constexpr std::int64_t kStep_us = 20'000;
  bool started_ = false;
  std::int64_t offset_us_ = 0;
};

}  // namespace bevel::nodes
