// Whether two messages of one stream can both be true: nothing moves faster than the axes can drive it.
#pragma once

#include <bevel/actuator_state_t.hpp>
#include <bevel/needle_state_t.hpp>

namespace bevel::io {

// What no axis of this rig exceeds.
struct MotionBounds {
  double insertion_rate_mm_s = 20;
  double rotation_rate_rad_s = 12;
};

struct Implausible {
  const char* what = nullptr;  // null: plausible. Static text
  double value = 0;
  double allowed = 0;
  const char* unit = "";
  explicit operator bool() const { return what != nullptr; }
};

// `before` and `next` in order of time. While neither axis is enabled in both, a new zero may be taken and the position
// jump.
Implausible check_motion(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds);
// An estimate moves with the needle, and by what its own covariance leaves open; after a declared reset anywhere.
Implausible check_motion(const needle_state_t& before, const needle_state_t& next, const MotionBounds& bounds);

// Neither axis is switched on: only then is a new zero taken.
bool at_rest_and_off(const actuator_state_t& state);

}  // namespace bevel::io
