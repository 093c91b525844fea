// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Two steering laws from the literature, as baselines for the controller on identical targets. No rig uses them.
///
/// Duty-cycled spinning (Minhas et al., IEEE EMBC 2007; Wood et al., IEEE BioRob 2010): a needle that spins during a
/// fraction D of the inserted length bends by (1 - D) of its curvature. In each cycle of insertion the bevel is rotated
/// by one turn more than the angle that points it at the target, while the fraction
///     D = 1 - min(1, kappa / k),  kappa = 2 a / (a^2 + z^2)
/// of the cycle is inserted; for the rest of the cycle the bevel keeps its direction. kappa is the curvature of the
/// circle along the heading through the target, which lies z ahead and a aside.
///
/// Bang-bang (a bevel that faces one of two sides, as in Reed et al., IEEE BioRob 2008): the bevel keeps its direction
/// until the target lies on the opposite side of the heading by more than a threshold. It is then rotated towards the
/// target while the insertion is stopped, and kept for a minimum inserted length. Without this length the target could
/// change sides repeatedly if rotation moves the tip.
///
/// Both laws steer towards the newest target position, and use only the pose and the curvature of the needle. Frame
/// {A}, mm.
#include <Eigen/Core>
#include <optional>

#include <bevel/controller/supervisor.hpp>

namespace bevel::rig {

/// Steering law: duty-cycled spinning or bang-bang.
enum class BaselineLaw {
  duty_cycle,  ///< duty-cycled spinning
  bang_bang    ///< bang-bang
};

/// Position of the target relative to the tip, and the rotation that points the bevel at it.
struct Sight {
  double ahead_mm = 0,  ///< distance along the heading, mm
      aside_mm = 0;     ///< distance perpendicular to the heading, mm
  /// Rotation of the bevel that points it at the target, in (-pi, pi].
  double facing_rad = 0;
};
/// Computes the position of a target relative to the tip.
/// @param tip              tip pose in {A}, mm
/// @param curvature_per_mm curvature of the needle, 1/mm; only the sign is used
/// @param target_mm        target in {A}, mm
/// @return position relative to the tip, and rotation to the target
Sight sight(const model::Pose& tip, double curvature_per_mm, const Eigen::Vector3d& target_mm);

/// Computes the fraction D of a cycle that is inserted while spinning.
/// @param sight            target relative to the tip
/// @param curvature_per_mm curvature of the needle, 1/mm
/// @return fraction in [0, 1]; 0 if the target lies on the circle of the needle or inside it
double duty(const Sight& sight, double curvature_per_mm);

/// Duty-cycled spinning.
class DutyCycle {
 public:
  /// Inserted length of one cycle, mm. One turn at 8 rad/s takes 3.9 mm at 5 mm/s.
  static constexpr double kCycle_mm = 5;
  /// Computes the rates, without ramps.
  /// @param sight            target relative to the tip
  /// @param curvature_per_mm curvature of the needle, 1/mm
  /// @param rotation_rad     position of the rotation axis, rad
  /// @param inserted_mm      position of the insertion axis, mm
  /// @param limits           limits of the rates and accelerations
  /// @return insertion rate, mm/s, and rotation rate, rad/s
  controller::Rates step(const Sight& sight, double curvature_per_mm, double rotation_rad, double inserted_mm,
                         const controller::SteeringLimits& limits);

 private:
  double next_mm_ = 0;  // inserted length at which the next cycle begins
  std::optional<double> to_rad_;
  double spun_mm_per_rad_ = 0;
};

/// Bang-bang steering.
class BangBang {
 public:
  static constexpr double kThreshold_mm = 0.5;  ///< smallest lateral distance of a target that causes a rotation
  static constexpr double kKept_mm = 2;         ///< least inserted length between two rotations
  /// Computes the rates, without ramps.
  /// @param sight        target relative to the tip
  /// @param rotation_rad position of the rotation axis, rad
  /// @param inserted_mm  position of the insertion axis, mm
  /// @param limits       limits of the rates and accelerations
  /// @return insertion rate, mm/s, and rotation rate, rad/s; the insertion rate is 0 during a rotation
  controller::Rates step(const Sight& sight, double rotation_rad, double inserted_mm,
                         const controller::SteeringLimits& limits);

 private:
  std::optional<double> turned_at_mm_;
  std::optional<double> to_rad_;
};

/// Applies one of the laws under the limits and ramps of the controller. The needle stops for good when the target is
/// no longer ahead or the estimate is unhealthy, and pauses while the estimate is unsure.
class BaselineSteering {
 public:
  /// Creates a law at rates 0.
  /// @param law    steering law
  /// @param limits limits of the rates and accelerations
  BaselineSteering(BaselineLaw law, const controller::SteeringLimits& limits) : law_(law), limits_(limits) {}
  /// Computes the rates of one period.
  /// @param needle    estimate of the needle, in {A}
  /// @param axes      state of the axes
  /// @param target_mm newest target position in {A}, mm
  /// @param dt_s      time since the last call, s
  /// @return insertion rate, mm/s, and rotation rate, rad/s, within the ramps
  controller::Rates step(const controller::NeedleView& needle, const model::ActuatorState& axes,
                         const Eigen::Vector3d& target_mm, double dt_s);
  /// @return false once the law has stopped the needle
  bool moves() const { return moves_; }
  /// @return true if the needle stopped because the target was no longer ahead
  bool arrived() const { return arrived_; }

 private:
  BaselineLaw law_;
  controller::SteeringLimits limits_;
  DutyCycle duty_cycle_;
  BangBang bang_bang_;
  controller::Rates rates_;
  bool moves_ = true, arrived_ = false;
};

}  // namespace bevel::rig
