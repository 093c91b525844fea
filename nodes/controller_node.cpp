#include "nodes/controller_node.hpp"

#include <Eigen/Eigenvalues>
#include <cstdio>

#include "nodes/needle_pose.hpp"

namespace bevel::nodes {
namespace {
// A loop this late has lost the needle: at 5 mm/s it is half a millimetre.
constexpr double kLateStop_s = 0.1;
}  // namespace

controller::NeedleView to_view(const needle_state_t& m) {
  controller::NeedleView v;
  v.utime = m.utime;
  v.pose = read_pose(m);
  v.curvature_per_mm = m.curvature_per_mm;
  v.lambda1_per_rad = m.lambda1_per_rad;
  v.lambda2 = m.lambda2;
  Eigen::Matrix3d position;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) position(r, c) = m.covariance[9 * r + c];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(position, Eigen::EigenvaluesOnly);
  v.position_variance_mm2 = eigen.eigenvalues()[2];
  v.health = m.health;
  v.reset_count = m.reset_count;
  return v;
}

ControllerNode::ControllerNode(lcm::LCM& lcm, const controller::ControllerConfig& config,
                               const model::NeedleParameters& needle, const std::vector<model::ActiveEffect>& effects)
    : config_(config),
      port_(lcm),
      // An effect may be of the needle itself, its direction of slip for instance.
      supervisor_(config, model::AugmentedNeedle(needle, effects).needle(), effects),
      status_(port_, "bevel-controller", config.period_s) {
  port_.subscribe<needle_state_t>(io::channel::kNeedleState,
                                  [this](const needle_state_t& m) { supervisor_.set_needle(to_view(m)); });
  port_.subscribe<actuator_state_t>(io::channel::kActuatorState,
                                    [this](const actuator_state_t& m) { supervisor_.set_actuator(io::to_sample(m)); });
  port_.subscribe<steering_target_t>(io::channel::kSteeringTarget, [this](const steering_target_t& m) {
    const controller::Target target{{m.position_mm[0], m.position_mm[1], m.position_mm[2]}, m.tolerance_mm};
    supervisor_.request(static_cast<controller::Request>(m.request), target, now_utime_);
  });
}

void ControllerNode::step(std::int64_t now_utime, double late_s) {
  now_utime_ = now_utime;
  if (late_s > kLateStop_s && supervisor_.status().state == controller::State::steering) {
    status_.note_overrun();
    supervisor_.report_overrun();
  }
  port_.publish(io::channel::kMotionCommand, io::to_message(supervisor_.step(now_utime, config_.period_s)));
  const controller::Status& s = supervisor_.status();
  std::string reason = controller::to_string(s.reason);
  char number[96];
  if (s.reason != controller::Reason::none && s.unit[0] != '\0') {
    std::snprintf(number, sizeof number, " (%.3g %s)", s.value, s.unit);
    reason += number;
  }
  status_.report(now_utime, controller::to_string(s.state), reason);
}

}  // namespace bevel::nodes
