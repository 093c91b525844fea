// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Reasons for which the axes are stopped.

#include <cstdint>
#include <string>

#include <bevel/drivers/stepper/cia301.hpp>

namespace bevel::stepper {

/// Reason of a stop. From drive_emergency on, the drive, the configuration or another master is at fault (is_fault()).
enum class StopReason : std::uint8_t {
  none,                  ///< no stop
  operator_stop,         ///< requested by the operator
  controller_stop,       ///< a set-point with `run` false while the axes move
  input_refused,         ///< the source of the commands cannot be trusted: two senders, or the clock was set
  ending,                ///< the process that drives the axes ends
  setpoint_stale,        ///< no set-point younger than setpoint_stop_age_ns
  setpoint_invalid,      ///< non-finite set-points, or ages below zero, for as long
  driver_overrun,        ///< step() was called too late
  drive_heartbeat_lost,  ///< no heartbeat of a drive within drive_heartbeat_timeout_ns
  drive_reset,           ///< a boot-up without a request: position not trusted
  drive_left_operation,  ///< not operational, or no longer enabled, without a command
  pdo_lost,              ///< no PDOs within tpdo_timeout_ns
  enable_timeout,        ///< the drives were not enabled within transition_timeout_ns
  not_following,         ///< the axis is not where the commanded rate should have moved it
  /// The drive's limit switch or its software limit stopped the axis (statusword bit 11). Once the drive's inputs
  /// (0x60FD) are read, the reason is one of the next three. It stays for a drive without 0x60FD.
  travel_limit,
  lower_switch,          ///< lower limit switch of the axis, in the driver's direction
  upper_switch,          ///< upper limit switch of the axis, in the driver's direction
  drive_limit,           ///< no switch is active: the drive's own limit (0x607D)
  bus_error_passive,     ///< the CAN controller is error-passive
  bus_off,               ///< the CAN controller is bus-off
  link_down,             ///< the interface is down or gone
  queue_full,            ///< queue_full_limit frames in a row were rejected
  transmit_stalled,      ///< accepted, but not on the wire: no participant acknowledges
  drive_emergency,       ///< EMCY; code: its error code
  drive_fault,           ///< statusword; code: 0x603F where known
  wrong_device,          ///< identity or capability; object, code: value found, wanted
  configuration_failed,  ///< a value read back differs, or never appears; object, code: value found, wanted
  setting_changed,       ///< a setting that was configured has another value now; object, code: value found, wanted
  sdo_aborted,           ///< object, wanted: value written, code: abort code
  sdo_timeout,           ///< object
  unit_unstated,         ///< neither the drive nor the configuration states a velocity unit
  /// Velocities count revolutions, counts_per_revolution is not configured; object, code: found.
  unit_needs_revolution,
  unit_contradicts,  ///< the drive states another unit or resolution than the configuration; object, code: found
  unit_unsupported,  ///< object, code: value found
  start_timeout,     ///< configured, but does not become operational
  too_fast,          ///< reports a higher rate than was commanded
  wrong_scale,       ///< travels another distance than commanded; code: per mille of it
  wrong_mode,        ///< 0x6061 is no longer the mode that was set
  second_drive,      ///< more PDOs than SYNCs: two drives with one node id, or old frames sent again
  foreign_master,    ///< another driver commands these drives; code: the CAN id that it used
  does_not_stop,     ///< measured: an axis moves on although it was stopped
};

/// Returns whether the drive, the configuration or another master is at fault.
/// @param reason reason of a stop
/// @return true from StopReason::drive_emergency on
constexpr bool is_fault(StopReason reason) { return reason >= StopReason::drive_emergency; }

/// Reason of a stop, with the axis and object concerned.
struct Stop {
  StopReason reason = StopReason::none;  ///< reason; none: no stop
  int axis = -1;                         ///< 0 insertion, 1 rotation, -1 neither
  std::uint32_t code = 0;                ///< see StopReason
  cia301::ObjectAddress object{};        ///< index 0: none
  std::uint32_t wanted = 0;              ///< value that the object should have
  bool is_write = false;                 ///< sdo_aborted: `wanted` was written
};

/// Returns the name of a reason.
/// @param reason reason of a stop
/// @return static string
const char* to_string(StopReason reason);

/// Describes one stop in one line for the operator: axis, what is wrong, object with its values, remedy. Allocates.
/// @param stop stop to describe
/// @return text without a line break
std::string describe(const Stop& stop);

/// Returns the text of an SDO abort code (CiA 301, table 22).
/// @param abort_code SDO abort code
/// @return static string; "unknown abort code" for codes that are not in the table
const char* abort_text(std::uint32_t abort_code);

/// Returns what to change if a drive rejects an object or keeps another value.
/// @param object address of the object
/// @return static string; "" if nothing specific is known
const char* remedy_for(cia301::ObjectAddress object);

}  // namespace bevel::stepper
