// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Travel limits of the simulated drive. Units are increments and seconds.

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::rig {

/// Limits the velocity: limit switches stop motion towards them, and software limits (0x607D) make the demand come to
/// rest at them.
struct TravelLimits {
  double low = -std::numeric_limits<double>::infinity();  ///< lower software limit of the demand's position, increments
  double high = std::numeric_limits<double>::infinity();  ///< upper software limit of the demand's position, increments
  bool negative_switch = false;                           ///< negative limit switch is closed
  bool positive_switch = false;                           ///< positive limit switch is closed

  /// Limits a velocity.
  /// @param wanted   wanted velocity, increments/s
  /// @param position position of the demand, increments
  /// @param ramp     deceleration, increments/s^2; > 0
  /// @return allowed velocity, increments/s
  double left_of(double wanted, double position, double ramp) const {
    const double up = positive_switch ? 0.0 : braking(high - position, ramp);
    const double down = negative_switch ? 0.0 : braking(position - low, ramp);
    return std::clamp(wanted, -down, up);
  }

 private:
  // A ramp cannot follow the infinite slope of the square root at zero, so the velocity is proportional to the room at
  // the end. Where the two parts meet, the line needs twice the deceleration of the root: 0.8 of the ramp with a share
  // of 0.4.
  static double braking(double room, double ramp) {
    constexpr double kShare = 0.4;
    constexpr double kLinearEnd_s = 0.005;
    return room <= 0.0 ? 0.0 : std::min(std::sqrt(2.0 * kShare * ramp * room), room / kLinearEnd_s);
  }
};

/// Positions of the limit switches, increments of the shaft; closed at and beyond. Infinite: no switch.
struct LimitSwitches {
  double negative_at = -std::numeric_limits<double>::infinity();  ///< position of the negative switch
  double positive_at = std::numeric_limits<double>::infinity();   ///< position of the positive switch
};

}  // namespace bevel::rig
