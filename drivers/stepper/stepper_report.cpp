// What the driver tells: its report, assembled from the drives and the transmitter.
#include <algorithm>

#include "drivers/stepper/stepper_driver.hpp"

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
  report.counters = counters_;
  report.counters.held_back = out_.held_back();
  report.counters.queue_full = bus_.counters().queue_full;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const DriveNode& node = nodes_.at(axis);
    report.status.at(axis) = status_of(node);
    report.position_trusted.at(axis) = node.position_trusted();
    report.error_code.at(axis) = node.error_code();
    report.stop_unconfirmed.at(axis) = latched() && withhold_heartbeat_ && !stop_confirmed_.at(axis);
    report.counters.missed_pdos += node.counters().missed_pdos;
    report.counters.malformed += node.counters().malformed;
    report.counters.sdo_ignored += node.sdo_ignored();
  }
  return report;
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
