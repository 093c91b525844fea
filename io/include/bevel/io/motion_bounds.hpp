// SPDX-License-Identifier: MIT
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

// Farther apart than motion can have brought it: of the positions alone.
Implausible check_jump(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds);
// `before` and `next` in order of time. While neither axis is enabled in both, a new zero may be taken and the position
// jump.
Implausible check_motion(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds);
// An estimate moves with the needle, and by what its own covariance leaves open; after a declared reset anywhere.
Implausible check_motion(const needle_state_t& before, const needle_state_t& next, const MotionBounds& bounds);

// Axes that report a rate and the same position all the time: their reports are not of now. Hand it each state in turn.
class StandstillCheck {
 public:
  Implausible see(const actuator_state_t& before, const actuator_state_t& next);

 private:
  int still_[2] = {0, 0};
};

// Both checks of axes in one, as a subscription wants it.
inline auto axes_check(const MotionBounds& bounds) {
  return [bounds, standstill = StandstillCheck{}](const actuator_state_t& before,
                                                  const actuator_state_t& next) mutable -> Implausible {
    const Implausible jump = check_motion(before, next, bounds);
    const Implausible still = standstill.see(before, next);
    return jump ? jump : still;
  };
}

// Neither axis is switched on: only then is a new zero taken.
bool at_rest_and_off(const actuator_state_t& state);

}  // namespace bevel::io
