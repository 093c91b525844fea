// SPDX-License-Identifier: MIT
// The list of effects, in the order in which they act on a leg: mounting, motor, gears, shaft, tissue, camera.
// Adding one: its file beside this one, and its line here.
#include <array>

#include <bevel/model/effects/effect.hpp>

#define BEVEL_EFFECTS(EFFECT) \
  EFFECT(slip_direction)      \
  EFFECT(entry_angle)         \
  EFFECT(bevel_offset)        \
  EFFECT(entry_point)         \
  EFFECT(lost_steps)          \
  EFFECT(rotation_backlash)   \
  EFFECT(torsional_windup)    \
  EFFECT(insertion_backlash)  \
  EFFECT(insertion_scale)     \
  EFFECT(stick_slip)          \
  EFFECT(puncture)            \
  EFFECT(rate_dependence)     \
  EFFECT(layer)               \
  EFFECT(depth_dependence)    \
  EFFECT(drilling)            \
  EFFECT(tip_swing)           \
  EFFECT(flip_transient)      \
  EFFECT(lateral_bias)        \
  EFFECT(cutting_angle)       \
  EFFECT(relaxation)          \
  EFFECT(tissue_motion)       \
  EFFECT(sensor_tilt)         \
  EFFECT(refraction)          \
  EFFECT(camera_rotation)     \
  EFFECT(camera_scale)        \
  EFFECT(camera_latency)

namespace bevel::model {

#define BEVEL_DECLARE(name) const Effect& name();
BEVEL_EFFECTS(BEVEL_DECLARE)
#undef BEVEL_DECLARE

std::span<const Effect* const> all_effects() {
#define BEVEL_LIST(name) &name(),
  static const std::array list = {BEVEL_EFFECTS(BEVEL_LIST)};
#undef BEVEL_LIST
  return list;
}

}  // namespace bevel::model
