// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Detection of an axis that does not follow its commanded rate.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace bevel::stepper {

/// Checks whether an axis moves as commanded.
///
/// An axis whose response delay is at most the allowed lag is at a position that the integral of the commanded rate had
/// at some time within that lag. An axis outside all of these positions does not follow: it is blocked, runs away, or
/// is driven by another master. Uses no clock and does not allocate.
class FollowWatch {
 public:
  /// Creates a watch.
  /// @param allowed_lag_ns largest allowed delay from a command to the motion, ns
  /// @param period_ns      period of the calls of follows(), ns
  FollowWatch(std::int64_t allowed_lag_ns, std::int64_t period_ns)
      : window_(std::clamp<std::size_t>(
            static_cast<std::size_t>(allowed_lag_ns / std::max<std::int64_t>(period_ns, 1)) + 1, 2, kRoom)),
        lag_s_(static_cast<double>(allowed_lag_ns) * 1e-9),
        delay_varies_s_(kDelayVaries_periods * static_cast<double>(period_ns) * 1e-9) {}

  /// Starts the watch on a stationary axis without a commanded rate.
  /// @param now_ns        steady clock, ns
  /// @param position_unit measured position, mm or rad
  void begin(std::int64_t now_ns, double position_unit) {
    now_ns_ = now_ns;
    anchor_ = position_unit;
    told_ = stands_ = commanded_unit_s_ = by_changes_ = 0;
    count_ = 0;
    rates_.fill(0);
  }

  /// Adds the time since the last call when the commanded rate is about to change between two cycles.
  /// @param now_ns           steady clock, ns
  /// @param commanded_unit_s rate commanded until now, mm/s or rad/s
  void advance(std::int64_t now_ns, double commanded_unit_s) {
    told_ += commanded_unit_s * static_cast<double>(now_ns - now_ns_) * 1e-9;
    now_ns_ = now_ns;
  }

  /// Checks the axis; called once in each cycle.
  /// @param now_ns           steady clock, ns
  /// @param commanded_unit_s rate commanded until now, mm/s or rad/s
  /// @param position_unit    measured position, mm or rad
  /// @return false if the position is more than 0.05 mm or rad outside the positions commanded within the allowed lag
  bool follows(std::int64_t now_ns, double commanded_unit_s, double position_unit) {
    const double dt_s = static_cast<double>(now_ns - now_ns_) * 1e-9;
    now_ns_ = now_ns;
    told_ += commanded_unit_s * dt_s;
    rates_.at(count_ % kRoom) = std::abs(commanded_unit_s);
    history_.at(count_++ % kRoom) = told_;
    stands_ = position_unit - anchor_;
    double low = told_, high = told_;
    for (std::size_t i = 1; i <= std::min(count_, window_); ++i) {
      low = std::min(low, history_.at((count_ - i) % kRoom));
      high = std::max(high, history_.at((count_ - i) % kRoom));
    }
    const double outside = stands_ - std::clamp(stands_, low, high);
    // Two deviations must not accumulate over an insertion: a small scale error, and a delay that differs between two
    // changes of rate. The effect of the delay is limited to the lag.
    const double scale = kScaleError * std::abs(commanded_unit_s) * dt_s;
    by_changes_ += delay_varies_s_ * std::abs(commanded_unit_s - commanded_unit_s_);
    commanded_unit_s_ = commanded_unit_s;
    const double forgiven = std::clamp(outside, -scale - by_changes_, scale + by_changes_);
    anchor_ += forgiven;
    by_changes_ -= std::max(0.0, std::abs(forgiven) - scale);
    by_changes_ *= std::max(0.0, 1 - dt_s / lag_s_);
    return std::abs(outside) <= kLeast_unit;
  }

  /// @return integral of the commanded rate since begin(), mm or rad
  double commanded_unit() const { return told_; }

  /// Returns the largest absolute rate that was commanded in the last cycles.
  /// @param cycles number of cycles; limited to those within the allowed lag
  /// @return rate, mm/s or rad/s; 0 without a cycle
  double fastest_commanded_unit_s(std::size_t cycles = kRoom) const {
    double fastest = 0;
    for (std::size_t i = 1; i <= std::min({count_, window_, cycles}); ++i)
      fastest = std::max(fastest, rates_.at((count_ - i) % kRoom));
    return fastest;
  }

  /// @return commanded travel minus measured travel, mm or rad
  double behind_unit() const { return told_ - stands_; }

 private:
  static constexpr std::size_t kRoom = 128;
  static constexpr double kScaleError = 0.02;  // relative, of a drive's rates compared with its positions
  // A command reaches its drive at any time of the drive's cycle: the delay varies by half a cycle.
  static constexpr double kDelayVaries_periods = 0.5;
  static constexpr double kLeast_unit = 0.05;  // mm or rad: steps, play, an encoder's noise

  std::size_t window_;
  double lag_s_;
  double delay_varies_s_;                // variation of the delay from a command to the motion, s
  double commanded_unit_s_ = 0;          // last
  double by_changes_ = 0;                // deviation that changes of rate can still explain, mm or rad
  std::array<double, kRoom> history_{};  // integral of the commanded rate, each cycle
  std::array<double, kRoom> rates_{};    // commanded rate without its sign, each cycle
  std::size_t count_ = 0;
  std::int64_t now_ns_ = 0;
  double anchor_ = 0;  // position of the axis at which the integral is zero
  double told_ = 0;
  double stands_ = 0;
};

}  // namespace bevel::stepper
