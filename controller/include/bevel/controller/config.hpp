// SPDX-License-Identifier: MIT
#pragma once
// What the controller may do and when it stops. One plain structure, filled from a file elsewhere.
#include <vector>

#include <bevel/controller/obstacle.hpp>
#include <bevel/controller/rendezvous.hpp>

namespace bevel::controller {

struct SteeringLimits {
  double insertion_rate_mm_s = 5.0;        // nominal
  double insertion_rate_min_share = 0.25;  // of the nominal while the bevel points away from the target
  double rotation_rate_rad_s = 8.0;        // largest
  double rotation_acceleration_rad_s2 = 40.0;
  double insertion_acceleration_mm_s2 = 40.0;
  double retraction_rate_mm_s = 5.0;
  double total_rotation_rad = 62.8;  // cable wrap, either way from the zero of the axis
};

struct SteeringGains {
  double convergence_rad_s = 1.5;    // eta: guaranteed rate of approach to sigma = 0 outside the boundary layer
  double boundary_layer_rad = 0.25;  // Phi
  // Of arcs: of the bend that is still to come, what the predicted miss may be off before it turns.
  double tube_share = 0.6;
  double tolerance_mm = 0.05;          // the law stops turning inside this predicted miss, or a target's if smaller
  double parameter_uncertainty = 0.3;  // relative error of k and f that the drift bound covers
};

/// Reaction to a target that has left the reachable set by more than the arrival tolerance.
enum class TargetLost { warn, stop };

// Ages and times are parts of the 200 ms within which the needle must rest after any fault; docs/hazards.md has the
// sum.
struct SafetyLimits {
  double state_age_s = 0.08;     // of NEEDLE_STATE
  double actuator_age_s = 0.08;  // of ACTUATOR_STATE
  double position_sd_mm = 3.0;   // largest along any axis
  double depth_min_mm = -2.0;    // workspace of the tip in {A}
  double depth_max_mm = 140.0;
  double lateral_max_mm = 60.0;
  // Reported rates outside what was commanded within axis_delay_s, by more than this, for tracking_error_s.
  double tracking_error_mm_s = 2.0;
  double tracking_error_rad_s = 2.5;
  double tracking_error_s = 0.04;
  double axis_delay_s = 0.12;      // from a command to the report of what it did
  double resting_motion_mm = 0.5;  // by which axes that are told to rest may move
  double resting_motion_rad = 0.2;
  double enabling_s = 3.0;  // from armed to both axes enabled
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

// A stiff shaft, as the estimator's prior has it (Prior::bending_mm): its tip moves toward the bevel of where it
// points.
struct ShaftConfig {
  double bending_mm = 0;  // 0: it moves where it points
  double guide_mm = 0;
};

// How it steers: by arcs, the bevel resting between turns (arc_law.hpp); by arcs with half turns at rest alone, for a
// rig that cannot turn while it inserts; or turning all the way (steering_law.hpp).
enum class Law { arcs, flip, spin };

struct ControllerConfig {
  Law law = Law::arcs;
  double period_s = 0.02;
  // Largest age of the operator program's heartbeat while the needle moves, and when it is armed or started.
  double operator_timeout_s = 0.5;
  ShaftConfig shaft;
  SteeringLimits limits;
  SteeringGains gains;
  FollowConfig follow;
  SafetyLimits safety;
  // As EstimatorConfig::through_channel: a needle that was drawn back comes out where its channel ends, and is steered
  // from there.
  bool through_channel = false;
  std::vector<Obstacle> obstacles;  // which Law::arcs goes round (path_plan.hpp), and no other
};

}  // namespace bevel::controller
