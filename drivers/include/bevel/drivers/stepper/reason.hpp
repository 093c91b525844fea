// SPDX-License-Identifier: MIT
// Why the axes were stopped.
#pragma once

#include <cstdint>
#include <string>

#include <bevel/drivers/stepper/cia301.hpp>

namespace bevel::stepper {

enum class StopReason : std::uint8_t {
  none,
  operator_stop,
  controller_stop,   // a set-point that says stop while the axes move
  input_refused,     // what commands the axes cannot be trusted: two senders, the clock was set
  ending,            // the process that drives them was told to end
  setpoint_stale,    // no set-point younger than setpoint_stop_age_ns
  setpoint_invalid,  // non-finite set-points, or ages below zero, for as long
  driver_overrun,    // step() was called too late
  drive_heartbeat_lost,
  drive_reset,           // an unasked boot-up: position not trusted
  drive_left_operation,  // not operational, or no longer enabled, without having been told to
  pdo_lost,              // no positions within tpdo_timeout_ns
  enable_timeout,
  not_following,  // is not where the commanded rate should have brought it
  travel_limit,  // the drive's limit switch or its software limit stopped the axis (statusword bit 11); once its inputs
                 // (0x60FD) are read, one of the next three. A drive without 0x60FD leaves it at this
  lower_switch,  // of the axis as the driver counts it, whichever way the drive does
  upper_switch,
  drive_limit,  // no switch is active: the drive's own limit (0x607D)
  bus_error_passive,
  bus_off,
  link_down,  // the interface is down or gone
  queue_full,
  transmit_stalled,  // accepted, but not on the wire: nobody acknowledges
  // From here on the drive, the configuration or another master is at fault.
  drive_emergency,        // EMCY; code: its error code
  drive_fault,            // statusword; code: 0x603F where known
  wrong_device,           // identity or capability; object, code: found, wanted
  configuration_failed,   // a value read back differs, or never appears; object, code: found, wanted
  setting_changed,        // a setting that was configured has another value now; object, code: found, wanted
  sdo_aborted,            // object, wanted: value written, code: abort code
  sdo_timeout,            // object
  unit_unstated,          // the drive states no velocity unit, nor does the configuration
  unit_needs_revolution,  // velocities count revolutions, counts_per_revolution is not configured; object, code: found
  unit_contradicts,       // the drive states another unit or resolution than the configuration; object, code: found
  unit_unsupported,       // object, code: found
  start_timeout,          // configured, but does not become operational
  too_fast,               // reports a higher rate than was commanded
  wrong_scale,            // travels another distance than commanded; code: per mille of it
  wrong_mode,             // 0x6061 is no longer the mode that was set
  second_drive,           // more answers than questions: two drives with one node id, or old frames sent again
  foreign_master,         // another driver commands our drives; code: the CAN id it used
  does_not_stop,          // measured: an axis moves on although it was stopped
};

constexpr bool is_fault(StopReason reason) { return reason >= StopReason::drive_emergency; }

/// Why the axes were stopped.
struct Stop {
  StopReason reason = StopReason::none;
  int axis = -1;                   ///< 0 insertion, 1 rotation, -1 neither
  std::uint32_t code = 0;          ///< see StopReason
  cia301::ObjectAddress object{};  ///< index 0: none
  std::uint32_t wanted = 0;        ///< value that the object should have
  bool is_write = false;           ///< sdo_aborted: `wanted` was written
};

const char* to_string(StopReason reason);

/// Describes one stop in one line for the operator: axis, what is wrong, object with its values, remedy. Allocates.
std::string describe(const Stop& stop);

/// Text of an SDO abort code (CiA 301, table 22); "unknown abort code" for others.
const char* abort_text(std::uint32_t abort_code);

/// Returns what to change if a drive rejects an object or keeps another value; "" if nothing specific is known.
const char* remedy_for(cia301::ObjectAddress object);

}  // namespace bevel::stepper
