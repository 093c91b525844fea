// SPDX-License-Identifier: MIT
#include <bevel/rig/drives/drive_motion.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::rig {
namespace {

constexpr double kStiction = 1e-3;  // increments: less than that is not moved from rest

}  // namespace

// Under constant acceleration a the lag's particular solution is d - T v_d + T^2 a; what differs from it decays by T.
void DriveMotion::follow(double dt_s, double a) {
  const double T = following_time_s_;
  const double apart = position_ - (demand_position_ - T * demand_per_s_ + T * T * a);
  demand_position_ += (demand_per_s_ + 0.5 * a * dt_s) * dt_s;
  demand_per_s_ += a * dt_s;
  if (blocked_) return;
  const double left = T > 0.0 ? std::exp(-dt_s / T) : 0.0;
  position_ = demand_position_ - T * demand_per_s_ + T * T * a + apart * left;
}

void DriveMotion::step(double dt_s, double target_per_s, double ramp_per_s2) {
  if (dt_s <= 0.0) return;
  const double change = target_per_s - demand_per_s_;
  const double ramp_s = std::min(dt_s, std::abs(change) / ramp_per_s2);
  if (ramp_s > 0.0) follow(ramp_s, std::copysign(ramp_per_s2, change));
  if (ramp_s < dt_s) {
    demand_per_s_ = target_per_s;  // what rounding left of it
    follow(dt_s - ramp_s, 0.0);
  }
  if (demand_per_s_ == 0.0 && !blocked_ && std::abs(following_error()) < kStiction) position_ = demand_position_;
}

double DriveMotion::velocity_per_s() const {
  if (blocked_) return 0.0;
  return following_time_s_ > 0.0 ? following_error() / following_time_s_ : demand_per_s_;
}

void DriveMotion::let_go() {
  demand_per_s_ = 0.0;
  demand_position_ = position_;
}

}  // namespace bevel::rig
