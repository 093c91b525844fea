#pragma once
// bevel-estimator: TIP_MEASUREMENT and ACTUATOR_STATE in, NEEDLE_STATE out, one for each actuator state.
#include "estimator/needle_estimator.hpp"
#include "nodes/lcm_port.hpp"

namespace bevel::nodes {

needle_state_t to_message(const estimator::Estimate& estimate, std::int64_t seq);

class EstimatorNode {
 public:
  EstimatorNode(lcm::LCM& lcm, const estimator::EstimatorConfig& config);
  // Health and status; everything else happens when messages arrive. The age limits of health are judged against this
  // time, so call it often (every 20 ms).
  void step(std::int64_t now_utime);
  const estimator::NeedleEstimator& estimator() const { return estimator_; }

 private:
  void publish();

  LcmPort port_;
  estimator::NeedleEstimator estimator_;
  StatusReporter status_;
  std::int64_t now_utime_ = 0;
  std::int64_t published_utime_ = 0;
  std::int64_t seq_ = 0;
};

}  // namespace bevel::nodes
