// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Comparison of the reported rates with the recent commands.
#include <array>
#include <cstddef>
#include <cstdint>

#include <bevel/controller/steering_law.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::controller {

/// Holds the recent commands, and compares each report of the axes with the commands of the report's own time, whatever
/// its latency is. Commands and reports have time stamps of the same clock.
class CommandWatch {
 public:
  /// Removes all commands.
  void restart() { count_ = 0; }
  /// Adds a command; the newest 256 are kept.
  /// @param utime time of the command, us
  /// @param commanded rates, mm/s and rad/s
  void remember(std::int64_t utime, const Rates& commanded) { past_[count_++ % kRoom] = {utime, commanded}; }

  /// Computes the distance of the reported rates from the range of the commands that may have been in effect: those
  /// from \p delay_s before the report until now.
  /// @param report reported rates, mm/s and rad/s, with their time, us
  /// @param delay_s delay of the axes, s
  /// @return distance for each axis, mm/s and rad/s, not negative; zero without commands
  Rates excess(const model::ActuatorState& report, double delay_s) const;

  /// Returns whether only zero rates were commanded in an interval up to now.
  /// @param now_utime current time, us
  /// @param for_s length of the interval, s
  /// @return false also if the commands do not cover the interval
  bool told_to_rest(std::int64_t now_utime, double for_s) const;

 private:
  struct Past {
    std::int64_t utime;
    Rates commanded;
  };
  // At the shortest period, 2 ms, the delay of the axes and the age that a report may have are 100.
  static constexpr std::size_t kRoom = 256;
  std::size_t kept() const { return count_ < kRoom ? count_ : kRoom; }
  const Past& newest(std::size_t i) const { return past_[(count_ - 1 - i) % kRoom]; }

  std::array<Past, kRoom> past_{};
  std::size_t count_ = 0;
};

}  // namespace bevel::controller
