// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Health word of an estimate, needle_state_t.health, and the causes of declared resets.
#include <cstdint>
#include <string>

namespace bevel::estimator {

/// Bits of the health word. 0: healthy.
enum Health : std::int32_t {
  kHealthy = 0,              ///< no bit is set
  kNoMeasurement = 1,        ///< no position was accepted since the start or the last reset
  kMeasurementStale = 2,     ///< the newest measurement exceeds HealthLimits::measurement_age_s
  kActuatorStale = 4,        ///< the newest actuator state, and so the estimate, is too old
  kUncertain = 8,            ///< the position variance exceeds its limit
  kRejecting = 16,           ///< more measurements in a row were rejected than outliers explain
  kOutsideModel = 32,        ///< the pose left the domain of the slip law (25); it is not propagated
  kNotFromEntry = 64,        ///< the estimate began with an inserted needle, whose path is unknown
  kCameraSilent = 128,       ///< a camera stopped sending
  kCameraFrozen = 256,       ///< a camera sends identical values while the needle moves
  kInputRefused = 512,       ///< two senders, or impossible motion; until the next arm command
  kUnsure = 1024,            ///< the newest measurements were rejected, perhaps as outliers; slow down
  kHeadingUncertain = 2048,  ///< the heading variance exceeds its limit
  // Cause of the newest reset: set for kResetReported_us after it, and until the estimate is within its limits again.
  kResetByRejects = 4096,   ///< reset by ResetCause::measurements_rejected
  kResetByBevel = 8192,     ///< reset by ResetCause::bevel_turned_over
  kResetByGap = 16384,      ///< reset by ResetCause::gap
  kResetByRestart = 32768,  ///< reset by ResetCause::restarted
  kResetByClock = 65536,    ///< reset by ResetCause::clock_set
};
/// All bits that report the cause of a reset. They are set for kResetReported_us after the reset, and until the
/// estimate is within its limits again.
inline constexpr std::int32_t kResetBits =
    kResetByRejects | kResetByBevel | kResetByGap | kResetByRestart | kResetByClock;

/// Cause of a declared reset.
enum class ResetCause : std::uint8_t {
  none,                   ///< there was no reset
  measurements_rejected,  ///< the gate rejected Gate::rejects_before_reset measurements in a row
  bevel_turned_over,      ///< measurements changed the sign of the curvature: the bevel is rotated by 180 degrees
  gap,                    ///< the motion of the axes was not reported for longer than AxisLimits::gap_s
  restarted,              ///< restarted by the operator, at the entry, or with a new zero of the axes
  clock_set,              ///< the time stamps were shifted
};

/// Computes the bit of a reset's cause in the health word.
/// @param cause cause of the reset
/// @return one of kResetBits; 0 for ResetCause::none
constexpr std::int32_t reset_bit(ResetCause cause) {
  return cause == ResetCause::none ? 0 : kResetByRejects << (static_cast<int>(cause) - 1);
}

/// Shortest time for which the health word has the cause of a reset, us. The controller acts on an estimate within the
/// age limit of 80 ms.
inline constexpr std::int64_t kResetReported_us = 200'000;

/// Computes the bits of a health word that forbid steering: all except kUnsure and the causes of resets.
/// @param health health word
/// @return those of its bits that forbid steering
constexpr std::int32_t lost(std::int32_t health) { return health & ~(static_cast<std::int32_t>(kUnsure) | kResetBits); }

/// Describes a health word for the operator.
/// @param health health word
/// @return a phrase for each bit, with commas between; "healthy" for 0. Allocates.
std::string describe_health(std::int32_t health);

/// One bit of the health word with the quantity that set it.
struct HealthFinding {
  Health flag = kHealthy;     ///< the bit; kHealthy: no bit that forbids steering is set
  const char* quantity = "";  ///< name of the quantity for a report
  double value = 0;           ///< value of the quantity, in `unit`
  double limit = 0;           ///< largest allowed value, in `unit`; 0: no limit
  const char* unit = "";      ///< unit of value and limit; empty for a number
};

}  // namespace bevel::estimator
