// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/reason.hpp>

#include <cstdio>

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
    case StopReason::too_fast:
      return "axis moves faster than commanded";
    case StopReason::wrong_scale:
      return "axis travels another distance than commanded";
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
      return "drive keeps another value than configured";
    case StopReason::setting_changed:
      return "a setting of the drive was changed";
    case StopReason::sdo_aborted:
      return "drive rejected its configuration";
    case StopReason::sdo_timeout:
      return "drive does not answer";
    case StopReason::unit_unstated:
      return "velocity unit unknown: the drive has neither 0x60A9 nor 0x6096";
    case StopReason::unit_needs_revolution:
      return "the drive's velocities are in revolutions";
    case StopReason::unit_contradicts:
      return "the drive states another unit than the configuration";
    case StopReason::unit_unsupported:
      return "unit of the drive is not supported";
    case StopReason::start_timeout:
      return "drive does not become operational";
    case StopReason::wrong_mode:
      return "drive left its mode of operation";
    case StopReason::second_drive:
      return "two drives answer with one node id, or frames are doubled on the bus";
    case StopReason::foreign_master:
      return "another master commands the drives";
    case StopReason::does_not_stop:
      return "axis DOES NOT STOP";
  }
  return "unknown";
}

namespace {

struct Text {
  std::uint32_t code;
  const char* text;
};

// CiA 301, table 22.
constexpr Text kAborts[] = {
    {0x05030000, "toggle bit not alternated"},
    {0x05040000, "SDO protocol timed out"},
    {0x05040001, "command not valid"},
    {0x05040005, "out of memory"},
    {0x06010000, "access not supported"},
    {0x06010001, "object is write-only"},
    {0x06010002, "object is read-only"},
    {0x06020000, "object does not exist"},
    {0x06040041, "object cannot be mapped to the PDO"},
    {0x06040042, "mapped objects exceed the PDO length"},
    {0x06040043, "parameter incompatible"},
    {0x06040047, "internal incompatibility in the device"},
    {0x06060000, "hardware error"},
    {0x06070010, "data type or length does not match"},
    {0x06070012, "length too high"},
    {0x06070013, "length too low"},
    {0x06090011, "sub-index does not exist"},
    {0x06090030, "value out of range"},
    {0x06090031, "value too high"},
    {0x06090032, "value too low"},
    {0x06090036, "maximum is less than minimum"},
    {0x08000000, "general error"},
    {0x08000020, "data cannot be stored"},
    {0x08000021, "data cannot be stored: local control"},
    {0x08000022, "data cannot be stored in the present device state"},
    {0x08000023, "object dictionary not available"},
};

bool is_pdo(std::uint16_t index) { return index >= 0x1400 && index < 0x1C00; }

const char* unit_remedy(StopReason reason) {
  switch (reason) {
    case StopReason::unit_unstated:
      return "set velocity_unit of the axis as the drive's manual states it";
    case StopReason::unit_needs_revolution:
      return "set counts_per_revolution of the axis: position counts in one revolution of the shaft, or set 0x60A9 in "
             "the drive to increments per second (0x00B50300)";
    case StopReason::unit_contradicts:
      return "make the drive's objects and velocity_unit, counts_per_revolution of the axis agree";
    case StopReason::unit_unsupported:
      return "set 0x60A9 in the drive to increments per second (0x00B50300), 0x6096 to 1:1 and 0x60AA to 0";
    default:
      return "";
  }
}

std::string hex(const char* format, std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, format, static_cast<unsigned>(value));
  return text;
}

std::string name_of(cia301::ObjectAddress object) {
  return "0x" + hex("%04X", object.index) + ":" + hex("%02X", object.sub);
}

// Objects of the profile hold numbers, others identifiers and unit codes.
std::string value_text(cia301::ObjectAddress object, std::uint32_t value) {
  const bool is_unit = object.index >= 0x60A8 && object.index <= 0x60AA;
  return object.index >= 0x6000 && !is_unit ? std::to_string(static_cast<std::int32_t>(value)) : hex("0x%X", value);
}

std::string details_of(const Stop& stop) {
  std::string object = name_of(stop.object);
  const std::string found = value_text(stop.object, stop.code), wanted = value_text(stop.object, stop.wanted);
  switch (stop.reason) {
    case StopReason::sdo_aborted:
      return object + (stop.is_write ? " = " + wanted : "") + ", abort code " + hex("%08X", stop.code) +
             "h: " + abort_text(stop.code);
    case StopReason::wrong_device:
    case StopReason::configuration_failed:
    case StopReason::setting_changed:
      return object + " is " + found + ", required " + wanted;
    case StopReason::unit_needs_revolution:
    case StopReason::unit_contradicts:
    case StopReason::unit_unsupported:
      return object + " is " + found;
    case StopReason::sdo_timeout:
      return object;
    case StopReason::wrong_scale:
      return std::to_string(stop.code / 10) + " % of it";
    case StopReason::wrong_mode:
      return "0x6061:00 is " + found;
    default:
      return stop.code == 0 ? "" : found;
  }
}

}  // namespace

const char* abort_text(std::uint32_t abort_code) {
  for (const auto& [code, text] : kAborts)
    if (code == abort_code) return text;
  return "unknown abort code";
}

const char* remedy_for(cia301::ObjectAddress object) {
  if (is_pdo(object.index))
    return "the drive needs PDOs whose mapping and type can be set; see its manual on PDO mapping";
  switch (object.index) {
    case 0x1000:
    case 0x1018:
      return "check node_id and the identity keys (vendor_id, product_code, revision, serial) of the axis";
    case 0x6502:
    case 0x6060:
    case 0x6061:
      return "set stepper.mode to a mode that the drive supports (0x6502): \"pv\" or \"csv\"";
    case 0x1016:
      return "the drive must monitor the master's heartbeat (0x1016): without it, it goes on if this computer stops";
    case 0x1017:
      return "the drive must send a heartbeat (0x1017); set stepper.drive_heartbeat_ms to a period that it supports";
    case 0x6007:
      return "the drive must stop when the connection is lost: quick stop (3) or disable voltage (2)";
    case 0x605A:
      return "set stepper.quick_stop_option to a value that the drive supports: 2 or 6";
    case 0x6085:
      return "set quick_stop_unit_s2 of the axis to a value that the drive supports; check its acceleration unit "
             "(0x60AA)";
    case 0x6083:
    case 0x6084:
      return "set acceleration_unit_s2 of the axis to a value that the drive supports; check its unit (0x60AA)";
    case 0x607F:
      return "set rate_limit_unit_s of the axis to at most what the drive supports";
    case 0x607D:
      return "set drive_position_min_unit and drive_position_max_unit of the axis to values that the drive supports";
    case 0x6065:
    case 0x6066:
      return "set following_error_unit of the axis to 0 to leave the drive's own value";
    default:
      return "";
  }
}

std::string describe(const Stop& stop) {
  std::string text;
  if (stop.axis >= 0) text += stop.axis == 0 ? "insertion: " : "rotation: ";
  text += to_string(stop.reason);
  if (const std::string details = details_of(stop); !details.empty()) text += " (" + details + ')';
  const char* remedy = unit_remedy(stop.reason);
  if (*remedy == '\0' && stop.object.index != 0) remedy = remedy_for(stop.object);
  if (*remedy != '\0') text += std::string("; ") + remedy;
  return text;
}

}  // namespace bevel::stepper
