// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Transmission between the axes and the tip by the effects of a model file.
#include <array>
#include <vector>

#include <bevel/controller/config.hpp>
#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::controller {

/// Computes how far the axes have to move for a motion of the tip: through a dead band of the rotation (backlash,
/// wind-up of the shaft), and to the insertion at which a tip that advances by jumps (stick-slip, puncture) stops
/// nearest to the target.
class AxisModel {
 public:
  /// Constructs the transmission of a list of effects.
  /// @param effects effects of the model file; those without influence between actuator and tip are allowed
  /// @throws bevel::ArgumentError if there are more than model::kMaxEffects
  explicit AxisModel(std::vector<model::ActiveEffect> effects);

  /// Returns whether an effect can keep the tip from rotating with the actuator.
  /// @return true if the rotation has a dead band
  bool turns_late() const { return turns_late_; }
  /// Returns whether an effect makes the tip stick and jump while the actuator advances steadily.
  /// @return true if the tip advances by jumps
  bool advances_by_jumps() const { return advances_by_jumps_; }

  /// Updates the effects by the actuator motion. The first call is the entry, without wind-up. Does not allocate.
  /// @param actuator positions of the axes, mm and rad
  /// @param tip_depth_mm z of the tip in {A}, mm
  void follow(const model::ActuatorState& actuator, double tip_depth_mm);

  /// Computes the rotation of the actuator until the tip rotates with it. It is the part of a long rotation that does
  /// not reach the tip.
  /// @param direction sign of the rotation
  /// @return remaining dead band in that direction, rad, not negative
  double take_up_rad(double direction) const;

  /// Computes the insertion of the actuator until the tip stops nearest to a point on its path. Does not allocate.
  ///
  /// A tip that jumps stops only between two jumps; the nearest of these positions may lie before or beyond the point.
  /// @param ahead_mm distance from the tip to the point along its path, mm, positive
  /// @return insertion, mm; 0 if no insertion brings the tip nearer; \p ahead_mm if the tip does not advance by jumps
  /// or
  ///     the point is more than 15 mm ahead
  double insertion_to_nearest_mm(double ahead_mm) const;

 private:
  struct Tip {
    double rotation_rad = 0, insertion_mm = 0;
    std::array<model::EffectMemory, model::kMaxEffects> memory;
  };
  void move(Tip& tip, const model::BaseMotion& from, const model::BaseMotion& to, double tip_depth_mm) const;
  bool find_late_turn() const;
  bool find_jumps() const;

  std::vector<model::ActiveEffect> effects_;
  bool turns_late_ = false, advances_by_jumps_ = false;
  bool entered_ = false;
  std::int64_t entry_utime_ = 0;
  model::BaseMotion entry_, base_;
  double tip_depth_mm_ = 0;
  Tip tip_;
};

/// Computes the rotation rate of the actuator for a rate of the tip. The rate is increased by as much as the axis can
/// brake within the remaining dead band.
/// @param tip_rate_rad_s rate of the tip, rad/s
/// @param take_up_rad remaining dead band in that direction, rad (AxisModel::take_up_rad)
/// @param share share of the increase, in [0, 1]; within the boundary layer it is proportional to sigma, so that noise
///     does not move the actuator across the dead band
/// @param limits limits of rate and acceleration
/// @return rate of the actuator, rad/s
double base_rate_rad_s(double tip_rate_rad_s, double take_up_rad, double share, const SteeringLimits& limits);

}  // namespace bevel::controller
