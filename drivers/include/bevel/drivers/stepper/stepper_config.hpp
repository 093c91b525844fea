// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Settings of the stepper driver, in plain structures. The reader of a configuration file fills them in.

#include <array>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace bevel::stepper {

inline constexpr std::size_t kInsertion = 0;  ///< index of the insertion axis
inline constexpr std::size_t kRotation = 1;   ///< index of the rotation axis
inline constexpr std::size_t kAxes = 2;       ///< number of axes

/// Velocity unit of a drive, coded as in object 0x60A9: exponent of ten, numerator, divisor (CiA 303-2).
enum class VelocityUnit : std::uint32_t {
  as_stated = 0,                ///< as the drive states it
  counts_per_s = 0x00B50300,    ///< position counts per second
  rpm = 0x00B44700,             ///< revolutions per minute
  tenth_rpm = 0xFFB44700,       ///< 0.1 rpm
  hundredth_rpm = 0xFEB44700,   ///< 0.01 rpm
  thousandth_rpm = 0xFDB44700,  ///< 0.001 rpm
};

/// Settings of one axis. "unit" is mm for the insertion axis and rad for the rotation axis.
struct AxisConfig {
  std::uint8_t node_id = 1;         ///< node id of the drive, 1..127
  double counts_per_unit = 1000.0;  ///< position counts in one mm or rad; the sign gives the direction; not 0
  double rate_limit_unit_s = 10.0;  ///< largest rate, mm/s or rad/s; > 0
  /// Acceleration of set-points and of the drive's own ramps, mm/s^2 or rad/s^2; > 0.
  double acceleration_unit_s2 = 100.0;
  double quick_stop_unit_s2 = 500.0;  ///< deceleration of a quick stop, mm/s^2 or rad/s^2; > 0
  /// Lower limit of the workspace, mm or rad from the entry point. The workspace is applied while the position is
  /// trusted: the rate decreases so that the axis comes to rest at the limit.
  double position_min_unit = -std::numeric_limits<double>::infinity();
  /// Upper limit of the workspace, mm or rad from the entry point; greater than position_min_unit.
  double position_max_unit = std::numeric_limits<double>::infinity();
  std::optional<double> drive_position_min_unit{},  ///< drive's own lower software limit (0x607D), mm or rad from the
                                                    ///< entry point; the drive holds the axis beyond it, which is a
                                                    ///< latched stop; empty: see drive_limits_of()
      drive_position_max_unit{};                    ///< drive's own upper software limit, likewise
  /// Position error at which the drive's own supervision of its motor (0x6065, 0x6066) reports a fault, mm or rad. 0
  /// leaves the drive's setting.
  double following_error_unit = 0.0;
  /// Velocity unit of a drive that states none (neither 0x60A9 nor 0x6096).
  VelocityUnit velocity_unit = VelocityUnit::as_stated;
  /// Position counts in one revolution of the shaft whose revolutions the drive's velocity unit counts. Needed for
  /// drives whose velocities are in rpm; 0: not configured.
  double counts_per_revolution = 0.0;
  /// Identity as in object 0x1018:1; 0 accepts any. The device type (0x1000 = 402) is always checked.
  std::uint32_t vendor_id = 0;
  std::uint32_t product_code = 0;  ///< as in object 0x1018:2; 0 accepts any
  std::uint32_t revision = 0;      ///< as in object 0x1018:3; 0 accepts any
  std::uint32_t serial = 0;        ///< as in object 0x1018:4; 0 accepts any
};

/// Software limits of a drive.
struct DriveLimits {
  double min_unit,  ///< lower limit, mm or rad from the entry point; infinite: none
      max_unit;     ///< upper limit, likewise
};
/// Returns the software limits of the drive: as configured, otherwise the workspace widened by the travel of the axis
/// at its rate limit in two cycles, which pass from a command to its effect, and in a quick stop. The driver brakes for
/// the workspace; the drive stops only motion that the driver did not prevent.
/// @param axis      settings of the axis
/// @param period_ns period of StepperDriver::step(), ns
/// @return limits, mm or rad from the entry point; infinite: none
DriveLimits drive_limits_of(const AxisConfig& axis, std::int64_t period_ns);

inline constexpr std::int64_t kMs = 1'000'000;  ///< one millisecond, ns

/// Modes of operation (0x6060) with a velocity as command. In both modes the driver shapes the rate.
enum class VelocityMode : std::uint8_t {
  /// Profile velocity (pv): the drive applies ramps by itself. A set-point acts when it arrives, so that jitter of the
  /// bus
  /// has no effect.
  profile = 3,
  /// Cyclic synchronous velocity (csv): set-points are latched by SYNC and interpolated over one period. Both axes act
  /// simultaneously.
  cyclic = 9,
};

/// Settings of a StepperDriver.
struct StepperConfig {
  /// Settings of the insertion and the rotation axis.
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
  std::uint8_t master_id = 127;               ///< node id of the driver's own heartbeat
  VelocityMode mode = VelocityMode::profile;  ///< mode of operation of both drives

  std::int64_t period_ns = 10 * kMs;            ///< period of step(), hence of SYNC
  std::int64_t listen_ns = 300 * kMs;           ///< silence required before the first frame, to detect a second driver
  std::int64_t master_heartbeat_ns = 30 * kMs;  ///< period of the driver's heartbeat
  /// Silence of the driver after which a drive stops by itself (0x1016).
  std::int64_t master_heartbeat_timeout_ns = 100 * kMs;
  std::int64_t drive_heartbeat_ns = 30 * kMs;           ///< period of the drives' heartbeats (0x1017)
  std::int64_t drive_heartbeat_timeout_ns = 100 * kMs;  ///< silence of a drive after which the axes are stopped
  std::int64_t sdo_timeout_ns = 500 * kMs;              ///< longest time from an SDO request to its answer
  int sdo_retries = 1;                                  ///< repetitions of an SDO transfer that timed out
  std::int64_t transition_timeout_ns = 1000 * kMs;      ///< limit for NMT start, mode change, enabling, fault reset
  std::int64_t boot_timeout_ns = 5000 * kMs;     ///< from an NMT reset to the drive's boot-up, before it is reset again
  std::int64_t tpdo_timeout_ns = 60 * kMs;       ///< largest age of the newest position
  std::int64_t echo_timeout_ns = 60 * kMs;       ///< longest time from acceptance of a frame to its echo
  std::int64_t overrun_stop_ns = 100 * kMs;      ///< interval of step() that stops the axes while enabled
  std::int64_t setpoint_zero_age_ns = 60 * kMs;  ///< set-points older than this: rate 0 by the normal ramp
  std::int64_t setpoint_stop_age_ns = 100 * kMs;  ///< set-points older than this: quick stop, latched
  std::int64_t not_following_ns = 80 * kMs;       ///< largest lag of an axis behind the commanded rate
  std::int64_t following_error_ns = 50 * kMs;     ///< 0x6066, if following_error_unit is not 0
  int queue_full_limit = 5;                       ///< rejected frames in a row that stop the axes
  std::int16_t quick_stop_option = 6;             ///< 0x605A: 6 stays in quick stop with torque, 2 releases the axis
};

/// Checks a configuration.
/// @param config settings of the driver
/// @return one sentence for each problem (key, value, allowed range); empty if the configuration can be used
std::vector<std::string> problems_of(const StepperConfig& config);

/// Checks whether the needle comes to rest within 200 ms of a fault. For rigs; not for buses in slow emulators.
/// @param config settings of the driver
/// @return one sentence for each setting that prevents it (key, value, allowed range); an empty list if none does
std::vector<std::string> safety_problems_of(const StepperConfig& config);

}  // namespace bevel::stepper
