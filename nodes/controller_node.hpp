#pragma once
// bevel-controller: NEEDLE_STATE, ACTUATOR_STATE and STEERING_TARGET in, MOTION_COMMAND out at a fixed rate.
#include "controller/supervisor.hpp"
#include "nodes/lcm_port.hpp"

namespace bevel::nodes {

controller::NeedleView to_view(const needle_state_t& message);

class ControllerNode {
 public:
  // `effects`: those that the estimator has, so that both believe in the same needle (SystemConfig::live_effects).
  ControllerNode(lcm::LCM& lcm, const controller::ControllerConfig& config, const model::NeedleParameters& needle,
                 const std::vector<model::ActiveEffect>& effects);
  // One period; call at config.period_s. late_s: how much later than due; run past a bound it stops motion.
  void step(std::int64_t now_utime, double late_s);
  const controller::Supervisor& supervisor() const { return supervisor_; }

 private:
  controller::ControllerConfig config_;
  LcmPort port_;
  controller::Supervisor supervisor_;
  StatusReporter status_;
  std::int64_t now_utime_ = 0;
};

}  // namespace bevel::nodes
