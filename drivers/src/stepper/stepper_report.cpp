// SPDX-License-Identifier: MIT
// What the driver tells: its report, assembled from the drives and the transmitter.
#include <algorithm>
#include <string>

#include <bevel/drivers/stepper/stepper_driver.hpp>

namespace bevel::stepper {
namespace {

AxisStatus status_of(const DriveNode& node) {
  if (node.phase() != DriveNode::Phase::operational) return AxisStatus::off;
  switch (node.state()) {
    case cia402::State::ready_to_switch_on:
    case cia402::State::switched_on:
      return AxisStatus::ready;
    case cia402::State::operation_enabled:
      return AxisStatus::enabled;
    case cia402::State::quick_stop_active:
      return AxisStatus::quick_stop;
    case cia402::State::fault_reaction:
    case cia402::State::fault:
      return AxisStatus::fault;
    default:
      return AxisStatus::off;
  }
}

}  // namespace

AxesReport StepperDriver::report() const {
  AxesReport report;
  report.sampled_ns = std::min(nodes_[kInsertion].sampled_ns(), nodes_[kRotation].sampled_ns());
  report.insertion_mm = nodes_[kInsertion].position_unit();
  report.insertion_rate_mm_s = nodes_[kInsertion].rate_unit_s();
  report.rotation_rad = nodes_[kRotation].position_unit();
  report.rotation_rate_rad_s = nodes_[kRotation].rate_unit_s();
  report.state = state_;
  report.stop = stop_;
  report.later = later_;
  report.heartbeat_ended = latched() && withhold_heartbeat_;
  report.counters = counters_;
  report.counters.held_back = out_.held_back();
  report.counters.queue_full = bus_.counters().queue_full;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const DriveNode& node = nodes_.at(axis);
    report.status.at(axis) = status_of(node);
    report.position_trusted.at(axis) = node.position_trusted();
    report.error_code.at(axis) = node.error_code();
    report.rest.at(axis) = rest_of(axis);
    report.order.at(axis) = orders_.at(axis);
    report.waits_for_boot.at(axis) = state_ == DriverState::configuring && node.waits_for_boot();
    report.counters.missed_pdos += node.counters().missed_pdos;
    report.counters.malformed += node.counters().malformed;
    report.counters.sdo_ignored += node.sdo_ignored();
  }
  return report;
}

namespace {

std::string axis_name(std::size_t axis) { return axis == kInsertion ? "insertion" : "rotation"; }

std::string describe_rest(const AxesReport& report, std::size_t axis) {
  const StopOrder order = report.order.at(axis);
  if (report.rest.at(axis) == AxisRest::not_measured)
    return axis_name(axis) + ": rest not measured, the drive must stop by its own monitoring of this computer";
  if (order < StopOrder::disable_voltage) return "";
  if (report.rest.at(axis) == AxisRest::at_rest)
    return axis_name(axis) +
           " DID NOT SLOW by its quick stop and is at rest since its voltage was disabled; check "
           "0x6085 and the drive's acceleration unit before arming again";
  return axis_name(axis) + " DOES NOT STOP: switch the drive's power off by hand (quick stop and disable voltage " +
         (order == StopOrder::nmt_stop ? "and NMT stop have" : "have") + " not brought it to rest)";
}

void append(std::string& text, const std::string& part) {
  if (part.empty()) return;
  if (!text.empty()) text += "; ";
  text += part;
}

}  // namespace

std::string describe(const AxesReport& report) {
  std::string text;
  for (std::size_t axis = 0; axis < kAxes; ++axis)
    if (report.order.at(axis) >= StopOrder::disable_voltage) append(text, describe_rest(report, axis));
  if (report.stop.reason != StopReason::none) append(text, describe(report.stop));
  if (report.later.reason != StopReason::none) append(text, "since then " + describe(report.later));
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (report.order.at(axis) < StopOrder::disable_voltage) append(text, describe_rest(report, axis));
    if (report.waits_for_boot.at(axis)) append(text, axis_name(axis) + ": reset sent, waiting for boot-up");
  }
  if (report.heartbeat_ended) append(text, "a drive did not confirm the stop: this computer's heartbeat was ended");
  return text;
}

const char* to_string(DriverState state) {
  switch (state) {
    case DriverState::off:
      return "off";
    case DriverState::configuring:
      return "configuring";
    case DriverState::ready:
      return "ready";
    case DriverState::enabled:
      return "enabled";
    case DriverState::stopped:
      return "stopped";
    case DriverState::fault:
      return "fault";
  }
  return "unknown";
}

}  // namespace bevel::stepper
