// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Limitation of a commanded rate to the rate, acceleration and workspace of an axis.

#include <algorithm>
#include <cmath>
#include <optional>

#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::stepper {

/// Limits the rate of one axis. Uses no clock and does not allocate.
class RateShaper {
 public:
  /// Creates a shaper at rate 0.
  /// @param axis settings of the axis: rate limit, acceleration, workspace
  explicit RateShaper(const AxisConfig& axis)
      : rate_limit_(axis.rate_limit_unit_s),
        acceleration_(axis.acceleration_unit_s2),
        min_(axis.position_min_unit),
        max_(axis.position_max_unit) {}

  /// Returns the rate to command next.
  /// @param wanted_unit_s wanted rate, mm/s or rad/s; finite
  /// @param dt_s          time since the last call, s
  /// @param position_unit measured position, mm or rad; empty if unknown: the workspace is then not applied
  /// @return rate within the rate, acceleration and workspace limits, mm/s or rad/s
  double step(double wanted_unit_s, double dt_s, std::optional<double> position_unit) {
    double target = std::clamp(wanted_unit_s, -rate_limit_, rate_limit_);
    if (position_unit)
      target = std::clamp(target, -braking_rate(*position_unit - min_), braking_rate(max_ - *position_unit));
    clamped_ = target != wanted_unit_s;
    const double change = acceleration_ * dt_s;
    rate_ = std::clamp(target, rate_ - change, rate_ + change);
    return rate_;
  }

  /// Sets the rate to 0.
  void reset() { rate_ = 0.0; }
  /// @return rate returned by the last step(), mm/s or rad/s
  double rate_unit_s() const { return rate_; }
  /// @return true if the last wanted rate exceeded the rate limit or the workspace limit
  bool clamped() const { return clamped_; }

 private:
  // Returns the rate from which the axis comes to rest within `room`, at 80 % of the full acceleration. The end is
  // linear, because no axis can follow the infinite slope of the square root at zero.
  double braking_rate(double room) const {
    constexpr double kLinearEnd_s = 0.05;
    if (room <= 0.0) return 0.0;
    return std::min({rate_limit_, std::sqrt(2.0 * 0.8 * acceleration_ * room), room / kLinearEnd_s});
  }

  double rate_limit_;
  double acceleration_;
  double min_;
  double max_;
  double rate_ = 0.0;
  bool clamped_ = false;
};

}  // namespace bevel::stepper
