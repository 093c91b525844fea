// SPDX-License-Identifier: MIT
// Settings of the stepper driver. Plain data: whoever reads a file fills it in.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace bevel::stepper {

inline constexpr std::size_t kInsertion = 0;
inline constexpr std::size_t kRotation = 1;
inline constexpr std::size_t kAxes = 2;

/// Velocity unit of a drive, coded as in object 0x60A9: exponent of ten, numerator, divisor (CiA 303-2).
enum class VelocityUnit : std::uint32_t {
  as_stated = 0,  ///< as the drive states it
  counts_per_s = 0x00B50300,
  rpm = 0x00B44700,
  tenth_rpm = 0xFFB44700,
  hundredth_rpm = 0xFEB44700,
  thousandth_rpm = 0xFDB44700,
};

// Units below: "unit" is mm for the insertion axis, rad for the rotation axis.
struct AxisConfig {
  std::uint8_t node_id = 1;             // 1..127
  double counts_per_unit = 1000.0;      // sign gives the direction; not 0
  double rate_limit_unit_s = 10.0;      // > 0
  double acceleration_unit_s2 = 100.0;  // > 0, of set-points and of the drive's own ramps
  double quick_stop_unit_s2 = 500.0;    // > 0
  // Workspace, applied while the position is trusted: the rate falls so that the axis comes to rest at the limit.
  double position_min_unit = -std::numeric_limits<double>::infinity();
  double position_max_unit = std::numeric_limits<double>::infinity();
  // The drive's own software limits (0x607D), from the entry too: beyond them it holds the axis by itself, which is a
  // latched stop. See drive_limits_of() for one that is not set.
  std::optional<double> drive_position_min_unit{}, drive_position_max_unit{};
  // The drive's own supervision of its motor (0x6065, 0x6066): by how much it may lag before it faults. 0 leaves the
  // drive's setting.
  double following_error_unit = 0.0;
  // Velocity unit of a drive that states none (neither 0x60A9 nor 0x6096).
  VelocityUnit velocity_unit = VelocityUnit::as_stated;
  // Position counts in one revolution of the shaft whose revolutions the drive's velocity unit counts. Needed for
  // drives whose velocities are in rpm; 0: not configured.
  double counts_per_revolution = 0.0;
  // Identity as in object 0x1018; 0 accepts any. The device type (0x1000 = 402) is always checked.
  std::uint32_t vendor_id = 0;
  std::uint32_t product_code = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
};

struct DriveLimits {
  double min_unit, max_unit;  // from the entry; infinite: none
};
// The drive's own limits: as set, else the workspace widened by what an axis goes at its rate limit in two cycles,
// which pass from a command to its effect, and in a quick stop. The driver brakes for the workspace, the drive only for
// what the driver lets through.
DriveLimits drive_limits_of(const AxisConfig& axis, std::int64_t period_ns);

inline constexpr std::int64_t kMs = 1'000'000;  // ns

// Modes of operation (0x6060) in which a drive takes a velocity. In both the driver shapes the rate.
enum class VelocityMode : std::uint8_t {
  profile = 3,  // pv: the drive ramps by itself; a set-point acts when it arrives, so jitter of the bus is harmless
  cyclic = 9,   // csv: set-points are latched by SYNC and interpolated over one period: both axes act at one instant
};

struct StepperConfig {
  std::array<AxisConfig, kAxes> axes{AxisConfig{.node_id = 1,
                                                .counts_per_unit = 2000.0,
                                                .rate_limit_unit_s = 20.0,
                                                .acceleration_unit_s2 = 200.0,
                                                .quick_stop_unit_s2 = 500.0},
                                     AxisConfig{.node_id = 2,
                                                .counts_per_unit = 51200.0 / (2.0 * std::numbers::pi),
                                                .rate_limit_unit_s = 12.0,
                                                .acceleration_unit_s2 = 60.0,
                                                .quick_stop_unit_s2 = 200.0}};
  std::uint8_t master_id = 127;  // node id of our own heartbeat
  VelocityMode mode = VelocityMode::profile;

  std::int64_t period_ns = 10 * kMs;                     // of step(), hence of SYNC
  std::int64_t listen_ns = 300 * kMs;                    // silence demanded before our first frame: no second driver
  std::int64_t master_heartbeat_ns = 30 * kMs;           // ours
  std::int64_t master_heartbeat_timeout_ns = 100 * kMs;  // after which a drive stops by itself (0x1016)
  std::int64_t drive_heartbeat_ns = 30 * kMs;            // theirs (0x1017)
  std::int64_t drive_heartbeat_timeout_ns = 100 * kMs;
  std::int64_t sdo_timeout_ns = 500 * kMs;
  int sdo_retries = 1;
  std::int64_t transition_timeout_ns = 1000 * kMs;  // NMT start, mode change, enabling, fault reset
  std::int64_t boot_timeout_ns = 5000 * kMs;      // from an NMT reset to the drive's boot-up, before it is reset again
  std::int64_t tpdo_timeout_ns = 60 * kMs;        // no fresh position
  std::int64_t echo_timeout_ns = 60 * kMs;        // a frame of ours that does not get onto the wire
  std::int64_t overrun_stop_ns = 100 * kMs;       // step() called this late while enabled
  std::int64_t setpoint_zero_age_ns = 60 * kMs;   // older: rate 0 by the normal ramp
  std::int64_t setpoint_stop_age_ns = 100 * kMs;  // older: quick stop, latched
  std::int64_t not_following_ns = 80 * kMs;       // by which an axis may lag behind the commanded rate
  std::int64_t following_error_ns = 50 * kMs;     // 0x6066, where following_error_unit is not 0
  int queue_full_limit = 5;                       // refused frames in a row
  std::int16_t quick_stop_option = 6;             // 0x605A: 6 stays in quick stop with torque, 2 lets go
};

// What is wrong with a configuration, one sentence each (key, value, allowed range); empty when it can be used.
std::vector<std::string> problems_of(const StepperConfig& config);

// What of it would keep a needle from resting within 200 ms of a fault: for rigs, not for buses in slow emulators.
std::vector<std::string> safety_problems_of(const StepperConfig& config);

}  // namespace bevel::stepper
