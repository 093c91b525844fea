// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Configuration of the controller: law, limits, gains and safety. Another module reads it from the system file.
#include <vector>

#include <bevel/controller/obstacle.hpp>
#include <bevel/controller/rendezvous.hpp>

/// Control of the needle: steering laws, path planning, target prediction and supervision.
namespace bevel::controller {

/// Limits of rate, acceleration and rotation.
struct SteeringLimits {
  double insertion_rate_mm_s = 5.0;  ///< nominal insertion rate, mm/s
  /// Smallest share of the nominal rate, used while the bevel rotates or points away from the target.
  double insertion_rate_min_share = 0.25;
  double rotation_rate_rad_s = 8.0;            ///< largest rotation rate, rad/s
  double rotation_acceleration_rad_s2 = 40.0;  ///< largest rotational acceleration, rad/s^2
  double insertion_acceleration_mm_s2 = 40.0;  ///< largest acceleration of the insertion, mm/s^2
  double retraction_rate_mm_s = 5.0;           ///< rate of a retraction, mm/s
  /// Largest rotation from the axis' zero in either direction, rad; limit of the cable.
  double total_rotation_rad = 62.8;
};

/// Gains of the laws.
struct SteeringGains {
  /// Eta, guaranteed rate at which sigma approaches 0 outside the boundary layer, rad/s.
  double convergence_rad_s = 1.5;
  double boundary_layer_rad = 0.25;  ///< Phi, width of the boundary layer, rad
  double tube_share = 0.6;           ///< Law::arcs and Law::flip: width of the tube as a share of the remaining bend
  /// Predicted miss that the law does not correct, mm; a smaller arrival tolerance replaces it.
  double tolerance_mm = 0.05;
  double parameter_uncertainty = 0.3;  ///< relative error of k and f that the drift bound covers
};

/// Reaction to a target that has left the reachable set by more than the arrival tolerance.
enum class TargetLost {
  warn,  ///< report it and continue to the closest approach
  stop   ///< stop the needle
};

/// Limits beyond which the needle stops. The ages and times are parts of the 200 ms within which the needle must be
/// stationary after any fault (docs/hazards.md has the sum).
struct SafetyLimits {
  double state_age_s = 0.08;     ///< largest age of NEEDLE_STATE, s
  double actuator_age_s = 0.08;  ///< largest age of ACTUATOR_STATE, s
  double position_sd_mm = 3.0;   ///< largest standard deviation of the tip along any axis, mm
  double depth_min_mm = -2.0;    ///< workspace of the tip: smallest z in {A}, mm
  double depth_max_mm = 140.0;   ///< workspace of the tip: largest z in {A}, mm
  double lateral_max_mm = 60.0;  ///< workspace of the tip: largest distance from the z axis of {A}, mm
  /// Largest difference of the reported insertion rate from the range commanded within axis_delay_s, mm/s.
  double tracking_error_mm_s = 2.0;
  double tracking_error_rad_s = 2.5;  ///< as tracking_error_mm_s, for the rotation, rad/s
  double tracking_error_s = 0.04;     ///< time after which such a difference stops the needle, s
  double axis_delay_s = 0.12;         ///< delay from a command to the report of its effect, s
  double resting_motion_mm = 0.5;     ///< largest motion of an insertion axis that is commanded to be stationary, mm
  double resting_motion_rad = 0.2;    ///< largest motion of a rotation axis that is commanded to be stationary, rad
  double enabling_s = 3.0;            ///< largest time from the arm command until both axes are enabled, s
  /// Predicted miss, mm, above which a target is refused before insertion and the needle stops during insertion.
  double target_miss_max_mm = 5.0;
  /// Largest distance, mm, from the tip to the target that counts as an arrival, unless the target has a tolerance of
  /// its own. The uncertainty of the estimate counts against it (arrival.hpp). 1 mm is above the errors that the
  /// literature reports in gel (0.35 to 0.86 mm, docs/steering.md).
  double arrival_tolerance_mm = 1.0;
  /// During insertion, when the predicted miss exceeds the arrival tolerance: report it and continue to the closest
  /// approach, or stop. Above target_miss_max_mm the needle stops in either case.
  TargetLost target_lost = TargetLost::warn;
};

/// Stiff shaft, as in estimator::Prior. Its tip moves at an angle to its heading, toward the bevel.
struct ShaftConfig {
  double bending_mm = 0;  ///< bending length in tissue, mm; 0: the shaft is not stiff
  double guide_mm = 0;    ///< distance from the guide to the entry point, mm
};

/// Steering law.
enum class Law {
  arcs,  ///< arcs with constant bevel angle between rotations (arc_law.hpp)
  flip,  ///< arcs with half turns while the insertion is stopped, for a rig that cannot rotate during insertion
  spin   ///< continuous rotation (steering_law.hpp)
};

/// Configuration of the Supervisor.
struct ControllerConfig {
  Law law = Law::arcs;     ///< steering law
  double period_s = 0.02;  ///< control period, s
  /// Largest age of the operator program's heartbeat during motion, and at an arm or start command, s.
  double operator_timeout_s = 0.5;
  ShaftConfig shaft;      ///< stiffness of the shaft
  SteeringLimits limits;  ///< limits of rate and acceleration
  SteeringGains gains;    ///< gains of the law
  FollowConfig follow;    ///< prediction of a moving target
  SafetyLimits safety;    ///< limits beyond which the needle stops
  /// As EstimatorConfig::through_channel: a retracted needle leaves its channel at the channel's end, and is steered
  /// from there.
  bool through_channel = false;
  std::vector<Obstacle> obstacles;  ///< obstacles to avoid; supported by Law::arcs only (path_plan.hpp)
};

}  // namespace bevel::controller
