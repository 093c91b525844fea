// SPDX-License-Identifier: MIT
#pragma once
// States of the controller, and why motion stops.

namespace bevel::controller {

enum class State { off, armed, steering, retracting, hold, stopped, fault };

enum class Reason {
  none,
  operator_stop,
  state_stale,      // NEEDLE_STATE too old, or none
  state_unhealthy,  // its health word is not zero
  state_uncertain,  // position variance above its bound
  state_reset,      // the estimator declared a reset during motion
  state_not_finite,
  actuator_stale,
  axes_not_enabled,    // quick stop, fault or off during motion
  insertion_tracking,  // an axis does not do what is commanded
  rotation_tracking,
  workspace,           // the tip left the allowed space
  target_unreachable,  // refused before insertion, with the predicted miss
  outside_model,       // the pose left the model's domain
  overrun,             // the loop could not keep its period
  resting_axes_moved,  // axes that were told to rest did not
  resting_tip_moved,   // the estimate moved while the axes rested
  off_the_axes,        // the tip is said to be farther from the entry than the needle was inserted
  input_refused,       // what comes in cannot be trusted: two senders, motion that cannot be, the clock was set
  operator_silent,     // the operator program's heartbeat is missing or too old during motion
  ending,              // the process was told to end
  path_blocked,        // no path to the target keeps clear of the obstacles; how near the best one comes
  obstacle_near,       // the tip is within an obstacle's clearance; what is left of that, negative
  way_point_missed,
  way_point_unreachable,  // refused before insertion, or found on the way; by how much the reach falls short
  way_points_too_many,
  retraction_refused,  // the depth that was told is none behind the tip
  channel_unknown,     // drawn back, and the estimator declared a reset since it was at the end of its channel
  way_in_unknown,      // to be drawn back, and nobody watched it go in; how much of it is inserted
  law_without_path,    // way-points or obstacles with a law that does not follow a path
  target_outside,      // a commanded target or way-point lies outside the workspace of the tip
  // The following are reasons of the state hold. No fault has stopped the needle.
  held,            // by the operator
  coming_to_rest,  // at the closest approach to the target; the outcome follows once the axes are stationary
  arrived,         // within the arrival tolerance, the uncertainty of the estimate included
  missed,          // at the depth of the target, outside the arrival tolerance
  retracted,       // to the commanded depth
};
const char* to_string(State state);
const char* to_string(Reason reason);

/// Returns whether \p reason refuses the commanded target itself, so that the same command is refused again.
bool refuses_target(Reason reason);

}  // namespace bevel::controller
