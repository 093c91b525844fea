// SPDX-License-Identifier: MIT
// The power stage, motor and encoder of the simulated drive: ramps, following error, position. Encoder increments and
// seconds.
//
// The demand's velocity v_d runs to its target by at most a ramp; the shaft x follows the demand's position d as a
// first-order lag, x' = (d - x) / T. Both are integrated exactly, so that position and velocity at an instant do not
// depend on how often, or how evenly, step() is called.
#pragma once

namespace bevel::rig {

class DriveMotion {
 public:
  explicit DriveMotion(double following_time_s) : following_time_s_(following_time_s) {}

  void step(double dt_s, double target_per_s, double ramp_per_s2);
  void let_go();  // no torque: friction holds the needle where it is
  void set_blocked(bool blocked) { blocked_ = blocked; }

  double demand_per_s() const { return demand_per_s_; }
  double demand_position() const { return demand_position_; }
  double position() const { return position_; }
  double velocity_per_s() const;  // of the shaft at this instant
  double following_error() const { return demand_position_ - position_; }

 private:
  void follow(double dt_s, double acceleration_per_s2);

  double following_time_s_;
  bool blocked_ = false;
  double demand_per_s_ = 0.0;
  double demand_position_ = 0.0;
  double position_ = 0.0;
};

}  // namespace bevel::rig
