// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// bevel-controller: subscribes to NEEDLE_STATE, ACTUATOR_STATE and STEERING_TARGET, publishes MOTION_COMMAND at a
/// fixed rate, with each estimate while it steers, and immediately when motion must stop.
#include <array>

#include <bevel/controller/supervisor.hpp>
#include <bevel/nodes/operator_heartbeat.hpp>
#include <bevel/nodes/operator_words.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::nodes {

/// Converts a NEEDLE_STATE message to the controller's input.
/// @param message message
/// @return estimate of the needle, pose in {A}, mm
controller::NeedleView to_view(const needle_state_t& message);

/// Computes the bounds that no axis of the rig exceeds, from the limits of the stepper driver.
/// @param config settings of the stepper driver
/// @return bounds for checks of received motion
io::MotionBounds motion_bounds(const stepper::StepperConfig& config);

/// Node of the process bevel-controller.
class ControllerNode {
 public:
  /// Creates the node; it commands no motion before it is armed.
  /// @param lcm    LCM; must outlive the node
  /// @param config system file
  ControllerNode(lcm::LCM& lcm, const SystemConfig& config);
  /// Sets the time at which messages are processed.
  /// @param now present time
  void tell_time(const Now& now) { port_.tell_time(now); }
  /// Checks the inputs for time-outs and publishes the command. Call it every config.controller.period_s.
  /// @param now    present time
  /// @param late_s delay of this call, s; a delay over a limit stops motion
  void step(const Now& now, double late_s);
  /// Publishes a stop, because this process ends.
  void end();

  /// @return port of the node
  LcmPort& port() { return port_; }
  /// @return supervisor of the motion
  const controller::Supervisor& supervisor() const { return supervisor_; }

 private:
  void check_alive(const needle_state_t& m);
  void on_word(Word word, const steering_target_t& m);
  bool is_refused(Word word);
  void on_trouble(const InputTrouble& trouble);
  void stop(controller::Reason reason, std::string detail = "");
  void command(double elapsed_s);
  void command_now();
  void report();

  controller::ControllerConfig config_;
  LcmPort port_;
  controller::Supervisor supervisor_;
  double bending_mm_ = 0;  // newest estimate for a stiff shaft; 0: as configured
  double bending_sd_mm_ = 0;
  StatusReporter status_;
  OperatorWords words_;
  OperatorWatch operator_;
  std::string operator_refusal_;          // why the newest request for motion was refused
  std::int64_t operator_refused_ns_ = 0;  // steady
  std::array<double, 3> same_position_mm_{};
  double insertion_mm_ = 0, same_since_insertion_mm_ = 0;
  std::int64_t stepped_ns_ = 0;  // steady; of the last period
  bool was_latched_ = false;
  std::string detail_;  // of the latched stop
};

}  // namespace bevel::nodes
