#include "nodes/estimator_node.hpp"

#include "estimator/health.hpp"
#include "nodes/needle_pose.hpp"

namespace bevel::nodes {

needle_state_t to_message(const estimator::Estimate& estimate, std::int64_t seq) {
  needle_state_t m{};
  const estimator::FilterState& s = estimate.state;
  m.utime = estimate.utime;
  m.seq = seq;
  m.measurement_utime = s.measurement_utime;
  write_pose(s.pose, m);
  m.curvature_per_mm = s.curvature_per_mm;
  m.lambda1_per_rad = s.lambda1_per_rad;
  m.lambda2 = s.lambda2;
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 9; ++c) m.covariance[9 * r + c] = s.covariance(r, c);
  m.test_ratio = estimate.newest_update.test_ratio;
  m.rank = estimate.newest_update.rank;
  m.health = estimate.health;
  m.reset_count = s.reset_count;
  return m;
}

EstimatorNode::EstimatorNode(lcm::LCM& lcm, const estimator::EstimatorConfig& config)
    : port_(lcm), estimator_(config), status_(port_, "bevel-estimator", 0) {
  port_.subscribe<tip_measurement_t>(io::channel::kTipMeasurement,
                                     [this](const tip_measurement_t& m) { estimator_.add(io::to_sample(m)); });
  port_.subscribe<actuator_state_t>(io::channel::kActuatorState, [this](const actuator_state_t& m) {
    estimator_.add(io::to_sample(m));
    publish();
  });
}

void EstimatorNode::publish() {
  // Between steps the newest actuator state is the newest time that is known.
  const estimator::Estimate estimate = estimator_.estimate(now_utime_);
  if (estimate.utime <= published_utime_) return;
  published_utime_ = estimate.utime;
  port_.publish(io::channel::kNeedleState, to_message(estimate, seq_++));
}

void EstimatorNode::step(std::int64_t now_utime) {
  now_utime_ = now_utime;
  const estimator::Estimate estimate = estimator_.estimate(now_utime);
  status_.report(now_utime, estimate.utime == 0 ? "waiting" : "running", estimator::describe_health(estimate.health));
}

}  // namespace bevel::nodes
