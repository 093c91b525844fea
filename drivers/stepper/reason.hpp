// Why the axes were stopped.
#pragma once

#include <array>
#include <cstdint>
#include <string>

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
  drive_emergency,       // EMCY; code: its error code
  drive_fault,           // statusword; code: 0x603F where known
  wrong_device,          // identity or capability; code: index << 8 | sub
  configuration_failed,  // a value read back differs, or never appears; code: index << 8 | sub
  sdo_aborted,           // code: SDO abort code
  sdo_timeout,           // code: index << 8 | sub
  start_timeout,         // configured, but does not become operational
  wrong_mode,            // 0x6061 is no longer the mode that was set
  second_drive,          // more answers than questions: two drives with one node id, or old frames sent again
  foreign_master,        // another driver commands our drives; code: the CAN id it used
};

constexpr bool is_fault(StopReason reason) { return reason >= StopReason::drive_emergency; }

struct Stop {
  StopReason reason = StopReason::none;
  int axis = -1;           // 0 insertion, 1 rotation, -1 neither
  std::uint32_t code = 0;  // see StopReason
};

const char* to_string(StopReason reason);
// unconfirmed: axes whose drive was stopped by ending our heartbeat.
std::string describe(
    const Stop& stop,
    std::array<bool, 2> unconfirmed = {});  // one line for the operator; allocates, so not on the control path

}  // namespace bevel::stepper
