// SPDX-License-Identifier: MIT
#pragma once
// Why an estimate must not be trusted: the bits of needle_state_t.health. Zero is healthy.
#include <cstdint>
#include <string>

namespace bevel::estimator {

enum Health : std::int32_t {
  kHealthy = 0,
  kNoMeasurement = 1,        // none accepted since the start or the last reset
  kMeasurementStale = 2,     // the newest measurement is too old
  kActuatorStale = 4,        // the newest actuator state is too old, so the estimate is too
  kUncertain = 8,            // position variance above its bound
  kRejecting = 16,           // the gate refused more measurements in a row than outliers are
  kOutsideModel = 32,        // the pose left the domain of the slip law; propagation stopped
  kNotFromEntry = 64,        // began with the needle in the tissue: its path up to there is not known
  kCameraSilent = 128,       // a camera stopped sending
  kCameraFrozen = 256,       // a camera sends the same values to the last bit while the needle moves
  kInputRefused = 512,       // two senders, or motion that cannot be; until armed anew
  kUnsure = 1024,            // the gate refused the newest readings: outliers perhaps; slow down until they pass
  kHeadingUncertain = 2048,  // heading variance above its bound
  // Why the last reset was declared (ResetCause): set for kResetReported_us after it, and until the estimate is within
  // its bounds again.
  kResetByRejects = 4096,
  kResetByBevel = 8192,
  kResetByGap = 16384,
  kResetByRestart = 32768,
  kResetByClock = 65536,
};
inline constexpr std::int32_t kResetBits =
    kResetByRejects | kResetByBevel | kResetByGap | kResetByRestart | kResetByClock;

/// Why a reset was declared: FilterState::reset_cause.
enum class ResetCause : std::uint8_t {
  none,
  measurements_rejected,  // the gate rejected Gate::rejects_before_reset in a row
  bevel_turned_over,      // measurements took the curvature across zero: the bevel is on the other side
  gap,                    // the motion of the axes was not reported for longer than AxisLimits::gap_s
  restarted,              // begun anew: by the operator, at the entry, or with a new zero of the axes
  clock_set,              // time stamps were shifted
};

/// Bit of \p cause in the health word; 0 for none.
constexpr std::int32_t reset_bit(ResetCause cause) {
  return cause == ResetCause::none ? 0 : kResetByRejects << (static_cast<int>(cause) - 1);
}

/// Time for which the cause of a reset is in the health word, us. The controller acts on an estimate within its age
/// limit, 80 ms.
inline constexpr std::int64_t kResetReported_us = 200'000;

/// Bits with which an estimate must not be steered by: all but kUnsure and the causes of resets.
constexpr std::int32_t lost(std::int32_t health) { return health & ~(static_cast<std::int32_t>(kUnsure) | kResetBits); }

std::string describe_health(std::int32_t health);

/// The quantity behind one bit of the health word: its value and its limit.
struct HealthFinding {
  Health flag = kHealthy;     ///< kHealthy: no bit is set that forbids steering
  const char* quantity = "";  ///< for a report: "measurements rejected in a row"
  double value = 0;
  double limit = 0;  ///< largest allowed; 0: the quantity has none
  const char* unit = "";
};

}  // namespace bevel::estimator
