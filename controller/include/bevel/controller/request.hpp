// SPDX-License-Identifier: MIT
#pragma once
// The operator's word, by its number in steering_target_t.request, where what each means is said. One list for all who
// hear it: the nodes, and of them the controller's supervisor.
#include <cstdint>

namespace bevel::controller {

enum class Request : std::int32_t {
  stop = 0,
  arm = 1,
  start = 2,
  hold = 3,
  entry = 4,
  confirm = 5,
  follow = 6,
  way_point = 7,
  retract = 8,
  arm_to_retract = 9
};

}  // namespace bevel::controller
