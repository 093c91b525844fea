// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// States of the controller, and reasons for a stop.

namespace bevel::controller {

/// State of the supervisor.
enum class State {
  off,         ///< no target; the axes are stopped
  armed,       ///< has a target, or is armed for a retraction; waits for a start or retract command
  steering,    ///< inserts the needle toward the target
  retracting,  ///< retracts the needle
  hold,        ///< decelerates and stands still; can continue
  stopped,     ///< latched stop, with its reason
  fault        ///< latched stop, since the estimate is not finite or outside the model
};

/// Reason of a stop, a hold or a rejected command.
enum class Reason {
  none,                ///< no reason
  operator_stop,       ///< stop command of the operator
  state_stale,         ///< NEEDLE_STATE is too old or missing
  state_unhealthy,     ///< the health word has a bit that forbids steering
  state_uncertain,     ///< the position variance exceeds its limit
  state_reset,         ///< the estimator declared a reset during motion
  state_not_finite,    ///< NEEDLE_STATE has a value that is not finite
  actuator_stale,      ///< ACTUATOR_STATE is too old or missing
  axes_not_enabled,    ///< an axis is in quick stop, fault or off, or was not enabled soon enough after the arm command
  insertion_tracking,  ///< the insertion axis does not follow the commands
  rotation_tracking,   ///< the rotation axis does not follow the commands
  workspace,           ///< the tip left its workspace
  target_unreachable,  ///< the predicted miss is too large, before or during insertion
  outside_model,       ///< the pose left the model's domain
  overrun,             ///< the control loop exceeded its period
  resting_axes_moved,  ///< axes that were commanded to be stationary moved
  resting_tip_moved,   ///< the estimated tip moved while the axes were stationary
  off_the_axes,        ///< the estimated tip is farther from the entry than the insertion
  input_refused,       ///< untrustworthy input: two senders, impossible motion, or a clock that was set
  operator_silent,     ///< the operator program's heartbeat is missing or too old during motion
  ending,              ///< the process terminates
  path_blocked,        ///< no path avoids the obstacles; the value is the smallest distance of the best one
  obstacle_near,       ///< the tip is within an obstacle's clearance; the value is the remainder, negative
  way_point_missed,    ///< a way-point was missed by more than its tolerance
  way_point_unreachable,  ///< a point of the path is out of reach; the value is the missing reach
  way_points_too_many,    ///< more than kMostWayPoints way-points
  retraction_refused,     ///< the commanded depth is not between 0 and the insertion
  channel_unknown,        ///< retracted, and the estimator has declared a reset since the end of the channel
  way_in_unknown,         ///< retraction of a needle whose insertion was not observed; the value is the insertion
  law_without_path,       ///< way-points or obstacles with a law that does not follow a path
  target_outside,         ///< a commanded target or way-point is outside the workspace of the tip
  // The following are reasons of the state hold. No fault has stopped the needle.
  held,            ///< hold command of the operator
  coming_to_rest,  ///< at the closest approach to the target; the outcome follows once the axes are stationary
  arrived,         ///< within the arrival tolerance, the uncertainty of the estimate included
  missed,          ///< at the depth of the target, outside the arrival tolerance
  retracted,       ///< retracted to the commanded depth
};
/// Returns the name of a state.
/// @param state the state
/// @return name, for example "steering"
const char* to_string(State state);
/// Returns the text of a reason for the operator.
/// @param reason the reason
/// @return phrase; empty for Reason::none
const char* to_string(Reason reason);

/// Returns whether a reason rejects the commanded target itself, so that the same command is rejected again.
/// @param reason the reason
/// @return true if another target has to be chosen
bool refuses_target(Reason reason);

}  // namespace bevel::controller
