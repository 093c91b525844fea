#include "drivers/stepper/reason.hpp"

#include <sstream>

namespace bevel::stepper {

const char* to_string(StopReason reason) {
  switch (reason) {
    case StopReason::none:
      return "none";
    case StopReason::operator_stop:
      return "stopped by the operator";
    case StopReason::controller_stop:
      return "stopped by the controller";
    case StopReason::input_refused:
      return "commands cannot be trusted";
    case StopReason::ending:
      return "told to end";
    case StopReason::setpoint_stale:
      return "set-points too old";
    case StopReason::setpoint_invalid:
      return "set-points not finite or from the future";
    case StopReason::driver_overrun:
      return "driver called too late";
    case StopReason::drive_heartbeat_lost:
      return "drive's heartbeat lost";
    case StopReason::drive_reset:
      return "drive was reset";
    case StopReason::drive_left_operation:
      return "drive left operation by itself";
    case StopReason::pdo_lost:
      return "no positions from the drive";
    case StopReason::enable_timeout:
      return "drive does not enable";
    case StopReason::not_following:
      return "axis does not follow the commanded rate";
    case StopReason::travel_limit:
      return "axis is at a limit switch or at the drive's own limit";
    case StopReason::lower_switch:
      return "axis is at its lower limit switch";
    case StopReason::upper_switch:
      return "axis is at its upper limit switch";
    case StopReason::drive_limit:
      return "axis is at the drive's own limit, no limit switch is active";
    case StopReason::bus_error_passive:
      return "CAN controller error-passive";
    case StopReason::bus_off:
      return "CAN controller bus-off";
    case StopReason::link_down:
      return "CAN link down or gone";
    case StopReason::queue_full:
      return "CAN transmit queue full";
    case StopReason::transmit_stalled:
      return "CAN frames do not get onto the wire";
    case StopReason::drive_emergency:
      return "drive sent an emergency";
    case StopReason::drive_fault:
      return "drive in fault";
    case StopReason::wrong_device:
      return "not the drive expected";
    case StopReason::configuration_failed:
      return "drive did not take its configuration";
    case StopReason::sdo_aborted:
      return "drive refused its configuration";
    case StopReason::sdo_timeout:
      return "drive does not answer";
    case StopReason::start_timeout:
      return "drive does not become operational";
    case StopReason::wrong_mode:
      return "drive left its mode of operation";
    case StopReason::second_drive:
      return "two drives answer with one node id, or frames are doubled on the bus";
    case StopReason::foreign_master:
      return "another master commands the drives";
  }
  return "unknown";
}

std::string describe(const Stop& stop, std::array<bool, 2> unconfirmed) {
  std::ostringstream text;
  if (stop.axis >= 0) text << (stop.axis == 0 ? "insertion: " : "rotation: ");
  text << to_string(stop.reason);
  if (stop.code != 0) text << " (0x" << std::hex << std::uppercase << stop.code << ')';
  if (unconfirmed[0] || unconfirmed[1])
    text << "; " << (unconfirmed[0] ? unconfirmed[1] ? "both drives" : "the insertion's drive" : "the rotation's drive")
         << " did not confirm the stop: our heartbeat was ended, on which drives stop by themselves";
  return text.str();
}

}  // namespace bevel::stepper
