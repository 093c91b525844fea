// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// bevel-stepper: subscribes to MOTION_COMMAND, drives the two axes over CAN, publishes ACTUATOR_STATE.
///
/// STEERING_TARGET carries the operator's command (bevel/nodes/operator_words.hpp): arm clears a latched stop and
/// enables the axes, stop stops them. Axes count from the entry point. If the drives' own counters are near zero at the
/// start, the first arm takes that as the entry. If they are not, the needle may be in the tissue, and the operator has
/// to command which it is: `entry`, the tip is at the entry point now, or `confirm`, the counters still count from
/// there. The operator has to do so again after a drive was lost.
#include <optional>
#include <string>

#include <bevel/drivers/stepper/stepper_driver.hpp>
#include <bevel/model/age.hpp>
#include <bevel/nodes/operator_words.hpp>

namespace bevel::nodes {

/// Node of the process bevel-stepper.
class StepperNode {
 public:
  /// Creates the node.
  /// @param lcm    LCM; must outlive the node
  /// @param bus    bus; must outlive the node and receive StepperDriver::listen_ids(config)
  /// @param config settings of the driver
  /// @throws ArgumentError listing every problem of config
  StepperNode(lcm::LCM& lcm, can::Bus& bus, const stepper::StepperConfig& config);
  /// Sets the time at which messages are processed.
  /// @param now present time
  void tell_time(const Now& now) { port_.tell_time(now); }
  /// @return true if a command waits for the bus, so that hear_bus() has an effect
  bool waits_for_bus() const { return driver_.command_waits(); }
  /// Processes received frames between cycles, when the bus is readable.
  /// @param now present time
  void hear_bus(const Now& now);
  /// Performs one cycle of config.period_ns.
  /// @param now present time
  void step(const Now& now);
  /// Requests a quick stop because this process ends. Call step() until at_rest().
  void end();
  /// @return true if both axes are measured at rest after a stop
  bool at_rest() const;

  /// @return port of the node
  LcmPort& port() { return port_; }
  /// @return state of the axes and the driver
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
  bool ran_since_armed_ = false;  // a set-point with mode `run` arrived since the axes were armed
  bool zero_known_ = false;
  bool was_latched_ = false;
  std::string detail_;   // of the latched stop
  std::string refusal_;  // why the axes were not enabled
};

}  // namespace bevel::nodes
