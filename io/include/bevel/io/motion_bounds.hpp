// SPDX-License-Identifier: MIT
/// \file
/// Checks whether two messages of one stream are consistent: nothing moves faster than the actuator can move it.
#pragma once

#include <bevel/actuator_state_t.hpp>
#include <bevel/needle_state_t.hpp>

namespace bevel::io {

/// Largest rates of the axes of the rig.
struct MotionBounds {
  double insertion_rate_mm_s = 20;  ///< largest insertion rate, mm/s
  double rotation_rate_rad_s = 12;  ///< largest rotation rate, rad/s
};

/// Result of a check: the violated limit, if any.
struct Implausible {
  const char* what = nullptr;  ///< static text: the quantity; null if the messages are plausible
  double value = 0;            ///< value found, in \ref unit
  double allowed = 0;          ///< largest value allowed, in \ref unit
  const char* unit = "";       ///< static text: "mm", "mm/s", "rad" or "rad/s"
  /// Returns true if the messages are implausible.
  explicit operator bool() const { return what != nullptr; }
};

/// Checks the positions of two actuator states, not their reported rates. The allowed motion is 1.5 times the largest
/// rate times the time between them, plus 0.5 mm or 0.2 rad.
/// @param before  one state
/// @param next  the other state; the order of time does not matter
/// @param bounds  largest rates
/// @return the violated limit
Implausible check_jump(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds);
/// Checks positions and rates of two actuator states. Rates may be 1.5 times the largest rate. Positions are not
/// checked if the axes are switched off in both states, since a new zero may have been set in between.
/// @param before  earlier state
/// @param next  later state
/// @param bounds  largest rates
/// @return the violated limit
Implausible check_motion(const actuator_state_t& before, const actuator_state_t& next, const MotionBounds& bounds);
/// Checks position and orientation of two estimates. The allowed motion is that of check_jump(), plus six standard
/// deviations of the estimate. All motions are allowed between estimates with different `reset_count`.
/// @param before  earlier estimate
/// @param next  later estimate
/// @param bounds  largest rates
/// @return the violated limit
Implausible check_motion(const needle_state_t& before, const needle_state_t& next, const MotionBounds& bounds);

/// Detects axes that report a rate and a constant position: their reports are not current.
class StandstillCheck {
 public:
  /// Checks one more state. Five consecutive states with equal positions and a rate above 0.5 mm/s or 0.5 rad/s are
  /// implausible.
  /// @param before  state before \p next
  /// @param next  newest state
  /// @return the rate of the axis that stands still
  Implausible see(const actuator_state_t& before, const actuator_state_t& next);

 private:
  int still_[2] = {0, 0};
};

/// Combines check_motion() and StandstillCheck, for a subscription.
/// @param bounds  largest rates
/// @return function of two consecutive states that returns Implausible
inline auto axes_check(const MotionBounds& bounds) {
  return [bounds, standstill = StandstillCheck{}](const actuator_state_t& before,
                                                  const actuator_state_t& next) mutable -> Implausible {
    const Implausible jump = check_motion(before, next, bounds);
    const Implausible still = standstill.see(before, next);
    return jump ? jump : still;
  };
}

/// Returns whether both axes are switched off. A new zero is set only in this state.
/// @param state  actuator state
/// @return true if both axes are model::AxisStatus::off or model::AxisStatus::ready
bool at_rest_and_off(const actuator_state_t& state);

}  // namespace bevel::io
