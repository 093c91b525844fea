// SPDX-License-Identifier: MIT
// How far the simulated drive's shaft may go: limit switches stop what moves towards them, software limits (607D) make
// the demand come to rest on them. Pure; increments and seconds.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::rig {

struct TravelLimits {
  double low = -std::numeric_limits<double>::infinity();  // software limits, of the demand's position
  double high = std::numeric_limits<double>::infinity();
  bool negative_switch = false;  // closed
  bool positive_switch = false;

  // What remains of a wanted velocity for a demand that stands at `position` and brakes by `ramp` (per s^2, > 0).
  double left_of(double wanted, double position, double ramp) const {
    const double up = positive_switch ? 0.0 : braking(high - position, ramp);
    const double down = negative_switch ? 0.0 : braking(position - low, ramp);
    return std::clamp(wanted, -down, up);
  }

 private:
  // A square root's slope at zero is more than a ramp can follow, so the velocity falls with the room at the end. Where
  // the two parts meet the line asks for twice the root's deceleration: with two fifths of the ramp, four fifths of it.
  static double braking(double room, double ramp) {
    constexpr double kShare = 0.4;
    constexpr double kLinearEnd_s = 0.005;
    return room <= 0.0 ? 0.0 : std::min(std::sqrt(2.0 * kShare * ramp * room), room / kLinearEnd_s);
  }
};

// Where the switches are, in increments of the shaft; none without one. Closed at and beyond.
struct LimitSwitches {
  double negative_at = -std::numeric_limits<double>::infinity();
  double positive_at = std::numeric_limits<double>::infinity();
};

}  // namespace bevel::rig
