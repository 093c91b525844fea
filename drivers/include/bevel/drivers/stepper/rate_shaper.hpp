// SPDX-License-Identifier: MIT
// From a wanted rate to one that an axis may be asked for: within its rate, acceleration and workspace limits. Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::stepper {

class RateShaper {
 public:
  explicit RateShaper(const AxisConfig& axis)
      : rate_limit_(axis.rate_limit_unit_s),
        acceleration_(axis.acceleration_unit_s2),
        min_(axis.position_min_unit),
        max_(axis.position_max_unit) {}

  // wanted_unit_s: finite. position_unit: nothing where it is not known; the workspace is then not applied.
  double step(double wanted_unit_s, double dt_s, std::optional<double> position_unit) {
    double target = std::clamp(wanted_unit_s, -rate_limit_, rate_limit_);
    if (position_unit)
      target = std::clamp(target, -braking_rate(*position_unit - min_), braking_rate(max_ - *position_unit));
    clamped_ = target != wanted_unit_s;
    const double change = acceleration_ * dt_s;
    rate_ = std::clamp(target, rate_ - change, rate_ + change);
    return rate_;
  }

  void reset() { rate_ = 0.0; }
  double rate_unit_s() const { return rate_; }
  bool clamped() const { return clamped_; }  // the last wanted rate was over a limit

 private:
  // The rate from which the axis comes to rest within `room`: by a fifth less than the full acceleration, and with a
  // linear end, as a square root's slope at zero is more than any axis can follow.
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
