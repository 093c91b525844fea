// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Operator commands.
#include <cstdint>

namespace bevel::controller {

/// Operator command, with its number in steering_target_t.request, which describes the commands in full.
enum class Request : std::int32_t {
  stop = 0,       ///< stop and latch
  arm = 1,        ///< take the target
  start = 2,      ///< start or continue steering
  hold = 3,       ///< decelerate and stop
  entry = 4,      ///< the tip is at the entry point: zero the axes and begin the estimate; ignored by the Supervisor
  confirm = 5,    ///< axes and estimate count from the entry point, though unobserved since; ignored by the Supervisor
  follow = 6,     ///< new position of a moving target
  way_point = 7,  ///< add a way-point for the target that is armed next
  retract = 8,    ///< retract to a depth
  arm_to_retract = 9  ///< arm without a target, for a retraction only
};

}  // namespace bevel::controller
