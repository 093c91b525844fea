// SPDX-License-Identifier: MIT
#include <bevel/rig/steering/baseline_steering.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bevel::rig {
namespace {

using controller::Rates;
using controller::SteeringLimits;

constexpr double kTurned_rad = 0.02;
constexpr double kBrakingShare = 0.6;  // of the acceleration, for an axis that follows late
constexpr double kConvergence_per_s = 8;
constexpr double kHalfTurn_rad = 0.8 * std::numbers::pi;  // from here on it may as well go the other way round

double turn_rate_rad_s(double left_rad, double largest_rad_s, const SteeringLimits& limits) {
  const double braking = std::sqrt(2 * kBrakingShare * limits.rotation_acceleration_rad_s2 * std::abs(left_rad));
  return std::copysign(std::min({largest_rad_s, braking, kConvergence_per_s * std::abs(left_rad)}), left_rad);
}

}  // namespace

Sight sight(const model::Pose& tip, double curvature_per_mm, const Eigen::Vector3d& target_mm) {
  const Eigen::Vector3d q = tip.R.transpose() * (target_mm - tip.p_mm);
  const double side = curvature_per_mm < 0 ? -1.0 : 1.0;
  return {q.z(), q.head<2>().norm(), std::atan2(side * q.x(), -side * q.y())};
}

double duty(const Sight& s, double curvature_per_mm) {
  const double squared_mm2 = s.aside_mm * s.aside_mm + s.ahead_mm * s.ahead_mm;
  if (!(squared_mm2 > 0)) return 1;
  return 1 - std::min(1.0, 2 * s.aside_mm / squared_mm2 / std::abs(curvature_per_mm));
}

Rates DutyCycle::step(const Sight& s, double curvature_per_mm, double rotation_rad, double inserted_mm,
                      const SteeringLimits& limits) {
  if (inserted_mm >= next_mm_) {
    next_mm_ = inserted_mm + kCycle_mm;
    const double spun_mm = duty(s, curvature_per_mm) * kCycle_mm;
    const double turn_rad = 2 * std::numbers::pi * (rotation_rad > 0 ? -1 : 1) + s.facing_rad;  // unwinds the cable
    to_rad_ = rotation_rad + turn_rad;
    spun_mm_per_rad_ = spun_mm / std::abs(turn_rad);
  }
  if (to_rad_ && std::abs(*to_rad_ - rotation_rad) < kTurned_rad) to_rad_.reset();
  if (!to_rad_) return {limits.insertion_rate_mm_s, 0};
  const double largest_rad_s =
      std::min(limits.rotation_rate_rad_s, limits.insertion_rate_mm_s / std::max(spun_mm_per_rad_, 1e-9));
  const double rate_rad_s = turn_rate_rad_s(*to_rad_ - rotation_rad, largest_rad_s, limits);
  return {spun_mm_per_rad_ * std::abs(rate_rad_s), rate_rad_s};
}

Rates BangBang::step(const Sight& s, double rotation_rad, double inserted_mm, const SteeringLimits& limits) {
  const bool passed = std::abs(s.facing_rad) > 0.5 * std::numbers::pi && s.aside_mm > kThreshold_mm;
  if (!to_rad_ && (!turned_at_mm_ || (passed && inserted_mm - *turned_at_mm_ >= kKept_mm))) {
    double turn_rad = s.facing_rad;
    if (std::abs(turn_rad) > kHalfTurn_rad && turn_rad * rotation_rad > 0)
      turn_rad -= std::copysign(2 * std::numbers::pi, turn_rad);  // unwinds the cable
    to_rad_ = rotation_rad + turn_rad;
    turned_at_mm_ = inserted_mm;
  }
  if (to_rad_ && std::abs(*to_rad_ - rotation_rad) < kTurned_rad) to_rad_.reset();
  if (!to_rad_) return {limits.insertion_rate_mm_s, 0};
  return {0, turn_rate_rad_s(*to_rad_ - rotation_rad, limits.rotation_rate_rad_s, limits)};
}

Rates BaselineSteering::step(const controller::NeedleView& needle, const model::ActuatorState& axes,
                             const Eigen::Vector3d& target_mm, double dt_s) {
  const Sight s = sight(needle.pose, needle.curvature_per_mm, target_mm);
  if (moves_ && (needle.health != 0 || s.ahead_mm <= 0)) {
    moves_ = false;
    arrived_ = needle.health == 0;
  }
  Rates wanted;
  if (moves_ && !needle.unsure) {
    wanted = law_ == BaselineLaw::duty_cycle
                 ? duty_cycle_.step(s, needle.curvature_per_mm, axes.rotation_rad, axes.insertion_mm, limits_)
                 : bang_bang_.step(s, axes.rotation_rad, axes.insertion_mm, limits_);
    // As the controller: never faster than the ramp can stop within what is left.
    wanted.insertion_mm_s =
        std::min(wanted.insertion_mm_s, std::sqrt(limits_.insertion_acceleration_mm_s2 * s.ahead_mm));
  }
  rates_ = controller::ramp(rates_, wanted, dt_s, limits_);
  return rates_;
}

}  // namespace bevel::rig
