#pragma once
// bevel-stepper: MOTION_COMMAND in, the two axes over CAN, ACTUATOR_STATE out.
//
// The operator's word is STEERING_TARGET: arm re-arms a latched stop and enables the axes, stop stops them. At the
// first arm the axes are taken to be at their zero (the tip at the entry point); after a drive was lost the position is
// no longer trusted, and only a restart with the tip at the entry point takes it again.
#include <optional>

#include "drivers/stepper/stepper_driver.hpp"
#include "nodes/lcm_port.hpp"

namespace bevel::nodes {

class StepperNode {
 public:
  // The bus must outlive the node and hear StepperDriver::listen_ids(config).
  StepperNode(lcm::LCM& lcm, can::Bus& bus, const stepper::StepperConfig& config);
  // One cycle of config.period_ns. now_ns: steady clock; now_utime: the same instant since the epoch.
  void step(std::int64_t now_ns, std::int64_t now_utime);
  stepper::AxesReport report() const { return driver_.report(); }

 private:
  void on_target(const steering_target_t& target);
  void publish(std::int64_t now_ns, std::int64_t now_utime, const stepper::AxesReport& report);

  LcmPort port_;
  stepper::StepperDriver driver_;
  StatusReporter status_;
  std::optional<stepper::MotionSetpoint> setpoint_;
  std::int64_t setpoint_utime_ = 0;
  std::int64_t last_seq_ = -1;
  std::int64_t published_ns_ = 0;
  std::int64_t seq_ = 0;
  bool enable_wanted_ = false;
  bool zero_taken_ = false;
};

}  // namespace bevel::nodes
