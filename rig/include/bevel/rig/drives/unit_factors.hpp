// SPDX-License-Identifier: MIT
// The drive's user units (CiA 402-2, factor group): its motor turns in encoder increments, its objects speak in what
// the master has set. Objects 608F (increments per motor revolution), 6091 (motor per shaft revolutions), 6092
// (position units per shaft revolution), 6096 (velocity units per position unit/s), each a numerator and a divisor.
#pragma once

#include <cmath>

#include <bevel/rig/drives/object_dictionary.hpp>

namespace bevel::rig {

struct UnitFactors {
  double position_per_increment = 1.0;  // position units; also of 6065, 607C, 607D
  double velocity_per_increment = 1.0;  // velocity units per increment/s; also accelerations, per s

  // velocity_unit: as 0x60A9 codes it, of revolutions per minute times a power of ten; 0: by the factor 0x6096.
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
