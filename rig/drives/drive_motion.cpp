#include "rig/drives/drive_motion.hpp"

#include <algorithm>
#include <cmath>

namespace bevel::rig {

void DriveMotion::step(double dt_s, double target_counts_s, double ramp_counts_s2) {
  if (dt_s <= 0.0) return;
  // The ramp ends somewhere inside the step: integrate the sloped and the flat part exactly.
  const double before = demand_counts_s_;
  const double ramp_s = std::min(dt_s, std::abs(target_counts_s - before) / ramp_counts_s2);
  demand_counts_s_ = before + std::copysign(ramp_counts_s2 * ramp_s, target_counts_s - before);
  if (ramp_s < dt_s) demand_counts_s_ = target_counts_s;
  demand_position_counts_ += 0.5 * (before + demand_counts_s_) * ramp_s + demand_counts_s_ * (dt_s - ramp_s);

  const double old_position = position_counts_;
  if (!blocked_) {
    const double closed = following_time_s_ > 0.0 ? -std::expm1(-dt_s / following_time_s_) : 1.0;
    position_counts_ += closed * (demand_position_counts_ - position_counts_);
  }
  velocity_counts_s_ = (position_counts_ - old_position) / dt_s;
}

void DriveMotion::let_go() {
  demand_counts_s_ = 0.0;
  demand_position_counts_ = position_counts_;
  velocity_counts_s_ = 0.0;
}

}  // namespace bevel::rig
