// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Units of a drive's velocity and acceleration objects.

#include <cstdint>
#include <optional>

#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/drivers/stepper/reason.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::stepper {

/// Unit objects of a drive (CiA 402-2, factor group). A member is empty if the drive does not have the object.
struct StatedUnits {
  std::optional<std::uint32_t> position_unit{};      ///< 0x60A8, SI unit of positions
  std::optional<std::uint32_t> velocity_unit{};      ///< 0x60A9, SI unit of velocities
  std::optional<std::uint32_t> acceleration_unit{};  ///< 0x60AA, SI unit of accelerations
  std::optional<std::uint32_t> factor[2]{};          ///< 0x6096, velocity factor: numerator, divisor
  std::optional<std::uint32_t> feed[2]{};            ///< 0x6092, position units; shaft revolutions
  std::optional<std::uint32_t> gear[2]{};            ///< 0x6091, motor revolutions; shaft revolutions
  std::optional<std::uint32_t> encoder[2]{};         ///< 0x608F, encoder increments; motor revolutions

  /// Returns the member that holds an object.
  /// @param object address of the object
  /// @return pointer to a member of this, or nullptr if the object states no unit
  std::optional<std::uint32_t>* find(cia301::ObjectAddress object);
};

/// Conversion between positions (0x6064, in counts) and the drive's velocity and acceleration objects.
struct UnitScales {
  double velocity_per_count_s = 1.0;       ///< velocity units in one count/s
  double acceleration_per_count_s2 = 1.0;  ///< acceleration units in one count/s^2
};

/// Result of scales_of(): the scales, or the reason for refusal and the object that causes it.
struct UnitDecision {
  UnitScales scales{};  ///< scales; valid if `refusal` is StopReason::none
  /// Reason of a refusal; StopReason::none: the scales are valid.
  StopReason refusal = StopReason::none;
  cia301::ObjectAddress object{};  ///< of a refusal
  std::uint32_t found = 0;         ///< value of that object; 0 if the drive does not have it
};

/// Derives the scales of velocity and acceleration from the drive's unit objects and the configuration.
///
/// Velocities are counts/s if the velocity factor is 1:1 or 0x60A9 names the position's unit per second. Another unit
/// is converted. A conversion between counts and revolutions needs AxisConfig::counts_per_revolution, because a drive's
/// objects may keep factory values that do not describe its motor; if both are available they must agree. Everything
/// else is rejected: a wrong unit would move the needle at a wrong speed.
/// @param stated unit objects as read from the drive
/// @param axis   settings of the axis
/// @return scales, or the reason of the refusal
UnitDecision scales_of(const StatedUnits& stated, const AxisConfig& axis);

}  // namespace bevel::stepper
