// SPDX-License-Identifier: MIT
#pragma once
// bevel-controller: NEEDLE_STATE, ACTUATOR_STATE and STEERING_TARGET in, MOTION_COMMAND out: at a fixed rate, while it
// steers with each estimate, and at once when motion must stop.
#include <array>

#include <bevel/controller/supervisor.hpp>
#include <bevel/nodes/operator_heartbeat.hpp>
#include <bevel/nodes/operator_words.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::nodes {

controller::NeedleView to_view(const needle_state_t& message);

// What no axis of the rig exceeds, of the stepper's limits.
io::MotionBounds motion_bounds(const stepper::StepperConfig& config);

class ControllerNode {
 public:
  ControllerNode(lcm::LCM& lcm, const SystemConfig& config);
  void tell_time(const Now& now) { port_.tell_time(now); }
  // Call at config.controller.period_s: the watchdog of its inputs. late_s: how much later than due; past a bound it
  // stops motion.
  void step(const Now& now, double late_s);
  // Says stop, because this process ends.
  void end();

  LcmPort& port() { return port_; }
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
  double bending_mm_ = 0;  // newest heard of a stiff shaft; 0: as configured
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
