// SPDX-License-Identifier: MIT
#pragma once
// bevel-stepper: MOTION_COMMAND in, the two axes over CAN, ACTUATOR_STATE out.
//
// STEERING_TARGET carries the operator's command (bevel/nodes/operator_words.hpp): arm clears a latched stop and
// enables the axes, stop stops them. Axes count from the entry point. Where the drives' own counters stand near zero at
// the start, the first arm takes that as the entry; where they do not, the needle may be in the tissue, and the
// operator has to command which it is: `entry`, the tip is at the entry point now, or `confirm`, the counters still
// count from there. The same after a drive was lost.
#include <optional>
#include <string>

#include <bevel/drivers/stepper/stepper_driver.hpp>
#include <bevel/model/age.hpp>
#include <bevel/nodes/operator_words.hpp>

namespace bevel::nodes {

class StepperNode {
 public:
  // The bus must outlive the node and hear StepperDriver::listen_ids(config).
  StepperNode(lcm::LCM& lcm, can::Bus& bus, const stepper::StepperConfig& config);
  void tell_time(const Now& now) { port_.tell_time(now); }
  // Between cycles, when the bus is readable; of use while a command waits for it.
  bool waits_for_bus() const { return driver_.command_waits(); }
  void hear_bus(const Now& now);
  // One cycle of config.period_ns.
  void step(const Now& now);
  // Quick stop because this process ends; step on until at_rest().
  void end();
  bool at_rest() const;  // both axes are measured at rest after a stop

  LcmPort& port() { return port_; }
  stepper::AxesReport report() const { return driver_.report(); }

 private:
  void on_command(const motion_command_t& m);
  void on_word(Word word);
  void on_trouble(const InputTrouble& trouble);
  void stop(stepper::StopReason reason, std::string detail = "");
  void note_latch();
  void enable_if_wanted(const stepper::AxesReport& report);
  void publish(const stepper::AxesReport& report);
  std::string reason(const stepper::AxesReport& report) const;

  stepper::StepperConfig config_;
  LcmPort port_;
  stepper::StepperDriver driver_;
  StatusReporter status_;
  OperatorWords words_;
  std::optional<stepper::MotionSetpoint> setpoint_;
  std::int64_t setpoint_made_ns_ = 0;  // steady clock
  std::int64_t published_ns_ = 0;
  std::int64_t seq_ = 0;
  bool enable_wanted_ = false;
  bool ran_since_armed_ = false;  // the controller has
  bool zero_known_ = false;
  bool was_latched_ = false;
  std::string detail_;   // of the latched stop
  std::string refusal_;  // why the axes were not enabled
};

}  // namespace bevel::nodes
