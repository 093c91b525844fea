// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// User units of the simulated drive (CiA 402-2, factor group). The motor turns in encoder increments; the objects use
/// the units that the master has set by 0x608F (increments per motor revolution), 0x6091 (motor per shaft revolutions),
/// 0x6092 (position units per shaft revolution) and 0x6096 (velocity units per position unit/s), each a numerator and a
/// divisor.

#include <cmath>

#include <bevel/rig/drives/object_dictionary.hpp>

namespace bevel::rig {

/// Conversion factors from encoder increments.
struct UnitFactors {
  double position_per_increment = 1.0;  ///< position units per increment; also of 0x6065, 0x607C, 0x607D
  double velocity_per_increment = 1.0;  ///< velocity units per increment/s; also accelerations, per s

  /// Computes the factors from an object dictionary.
  /// @param od            dictionary with the factor objects
  /// @param velocity_unit unit coded as 0x60A9: revolutions per minute times a power of ten; 0: by the factor 0x6096
  /// @return factors
  /// @throws std::out_of_range if a factor object does not exist
  static UnitFactors of(const ObjectDictionary& od, std::uint32_t velocity_unit) {
    const auto fraction = [&od](std::uint16_t index) {
      return static_cast<double>(od.get(index, 1)) / static_cast<double>(od.get(index, 2));
    };
    const double revolutions_per_increment = 1.0 / (fraction(0x608F) * fraction(0x6091));
    UnitFactors factors;
    factors.position_per_increment = fraction(0x6092) * revolutions_per_increment;
    if (velocity_unit == 0) {
      factors.velocity_per_increment = factors.position_per_increment * fraction(0x6096);
    } else {
      factors.velocity_per_increment =
          60.0 * revolutions_per_increment / std::pow(10.0, static_cast<std::int8_t>(velocity_unit >> 24));
    }
    return factors;
  }
};

}  // namespace bevel::rig
