// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Power stage, motor and encoder of the simulated drive: ramps, following error, position. Units are encoder
/// increments and seconds.

namespace bevel::rig {

/// Simulates demand and shaft. The velocity v_d of the demand changes to its target by at most a ramp. The shaft x
/// follows the position d of the demand as a first-order lag, x' = (d - x) / T. Both are integrated exactly, so that
/// position and velocity do not depend on the times of the calls of step().
class DriveMotion {
 public:
  /// Creates a stationary shaft at position 0.
  /// @param following_time_s lag T of the shaft behind the demand, s; 0: none
  explicit DriveMotion(double following_time_s) : following_time_s_(following_time_s) {}

  /// Advances the motion.
  /// @param dt_s         time step, s; nothing happens unless > 0
  /// @param target_per_s target velocity, increments/s
  /// @param ramp_per_s2  acceleration, increments/s^2; > 0
  void step(double dt_s, double target_per_s, double ramp_per_s2);
  /// Switches the torque off: the needle stops, as friction holds it.
  void let_go();
  /// Sets whether the shaft is blocked.
  /// @param blocked true: the shaft does not move
  void set_blocked(bool blocked) { blocked_ = blocked; }

  /// @return velocity of the demand, increments/s
  double demand_per_s() const { return demand_per_s_; }
  /// @return position of the demand, increments
  double demand_position() const { return demand_position_; }
  /// @return position of the shaft, increments
  double position() const { return position_; }
  /// @return velocity of the shaft, increments/s
  double velocity_per_s() const;
  /// @return position of the demand minus position of the shaft, increments
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
