// The power stage, motor and encoder of the simulated drive: ramps, following error, position. Counts and seconds.
#pragma once

namespace bevel::rig {

class DriveMotion {
 public:
  explicit DriveMotion(double following_time_s) : following_time_s_(following_time_s) {}

  // Demand runs towards `target` by at most `ramp`; the motor follows it as a first-order lag.
  void step(double dt_s, double target_counts_s, double ramp_counts_s2);
  void let_go();  // no torque: friction holds the needle where it is
  void power_on() { *this = DriveMotion{following_time_s_}; }
  void set_blocked(bool blocked) { blocked_ = blocked; }

  double demand_counts_s() const { return demand_counts_s_; }
  double position_counts() const { return position_counts_; }
  double velocity_counts_s() const { return velocity_counts_s_; }
  double following_error_counts() const { return demand_position_counts_ - position_counts_; }

 private:
  double following_time_s_;
  bool blocked_ = false;
  double demand_counts_s_ = 0.0;
  double demand_position_counts_ = 0.0;
  double position_counts_ = 0.0;
  double velocity_counts_s_ = 0.0;
};

}  // namespace bevel::rig
