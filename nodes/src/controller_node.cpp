// SPDX-License-Identifier: MIT
#include <bevel/nodes/controller_node.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <bevel/estimator/health.hpp>
#include <bevel/nodes/needle_pose.hpp>

namespace bevel::nodes {
namespace {

// A loop this late has lost the needle: at 5 mm/s it is half a millimetre.
constexpr double kLateStop_s = 0.1;
constexpr double kSeenToMove_mm = 0.1;     // of insertion within which an estimate must have moved
constexpr double kFastestCycle_hz = 1200;  // of drives
constexpr std::int64_t kRefusalShown_ns = 5'000'000'000;
constexpr double kFastestState_hz = 3200;  // the estimator sends one for each cycle and each reading

io::SenderLimits input_limits(double age_s, double fastest_hz) {
  const auto age_us = std::llround(age_s * 1e6);
  return {.longest_age_us = age_us, .fastest_hz = fastest_hz, .silence_us = age_us};
}

io::ProcessState to_process_state(controller::State state) {
  switch (state) {
    case controller::State::off:
      return io::ProcessState::off;
    case controller::State::armed:
      return io::ProcessState::armed;
    case controller::State::steering:
      return io::ProcessState::steering;
    case controller::State::retracting:
      return io::ProcessState::retracting;
    case controller::State::hold:
      return io::ProcessState::hold;
    case controller::State::stopped:
      return io::ProcessState::stopped;
    case controller::State::fault:
      return io::ProcessState::fault;
  }
  return io::ProcessState::fault;
}

bool latched(controller::State state) {
  return state == controller::State::stopped || state == controller::State::fault;
}

}  // namespace

io::MotionBounds motion_bounds(const stepper::StepperConfig& config) {
  return {config.axes[stepper::kInsertion].rate_limit_unit_s, config.axes[stepper::kRotation].rate_limit_unit_s};
}

controller::NeedleView to_view(const needle_state_t& m) {
  controller::NeedleView v;
  v.utime = m.utime;
  v.pose = read_pose(m);
  v.curvature_per_mm = m.curvature_per_mm;
  v.lambda1_per_rad = m.lambda1_per_rad;
  v.lambda2 = m.lambda2;
  v.uncertain.curvature_per_mm = std::sqrt(m.covariance[9 * 6 + 6]);
  Eigen::Matrix3d position;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) position(r, c) = m.covariance[9 * r + c];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(position, Eigen::EigenvaluesOnly);
  v.position_variance_mm2 = eigen.eigenvalues()[2];
  v.heading_variance_rad2 = std::max(m.covariance[9 * 3 + 3], m.covariance[9 * 4 + 4]);
  v.health = estimator::lost(m.health);
  v.unsure = (m.health & estimator::kUnsure) != 0;
  v.reset_count = m.reset_count;
  v.reset_cause = m.health & estimator::kResetBits;
  v.from_entry = (m.health & estimator::kNotFromEntry) == 0;
  return v;
}

ControllerNode::ControllerNode(lcm::LCM& lcm, const SystemConfig& config)
    : config_(config.controller),
      port_(lcm),
      // An effect may be of the needle itself, its direction of slip for instance.
      supervisor_(config.controller, model::AugmentedNeedle(config.needle, config.live_effects.active).needle(),
                  config.live_effects.active),
      status_(port_, "bevel-controller", config.controller.period_s),
      words_(port_, status_, Receiver::controller, [this](Word word, const steering_target_t& m) { on_word(word, m); }),
      operator_(config.controller.operator_timeout_s) {
  const io::MotionBounds bounds = motion_bounds(config.stepper);
  port_.on_trouble = [this](const InputTrouble& trouble) { on_trouble(trouble); };
  port_.subscribe<needle_state_t>(
      io::channel::kNeedleState, input_limits(config_.safety.state_age_s, kFastestState_hz),
      [this](const needle_state_t& m) {
        check_alive(m);
        controller::NeedleView view = to_view(m);
        view.bending_mm = bending_mm_;
        view.uncertain.bending_mm = bending_sd_mm_;
        supervisor_.set_needle(view);
        if (!supervisor_.watch(port_.now().utime))
          command(0);
        else if (supervisor_.moves())
          command_now();
      },
      [bounds](const needle_state_t& before, const needle_state_t& next) {
        return io::check_motion(before, next, bounds);
      });
  // Not watched: without it the law steers by the configured shaft, and what it steers by is watched above.
  port_.subscribe<needle_shaft_t>(io::channel::kNeedleShaft, [this](const needle_shaft_t& m) {
    if (config_.shaft.bending_mm > 0) bending_mm_ = m.bending_mm, bending_sd_mm_ = m.bending_sd_mm;
  });
  port_.subscribe<actuator_state_t>(
      io::channel::kActuatorState, input_limits(config_.safety.actuator_age_s, kFastestCycle_hz),
      [this](const actuator_state_t& m) {
        insertion_mm_ = m.insertion_mm;
        supervisor_.set_actuator(io::to_sample(m));
      },
      io::axes_check(bounds));
  // The watch of the operator refuses a second sender without a stop: it cannot move the needle.
  port_.subscribe<operator_heartbeat_t>(io::channel::kOperatorHeartbeat, [this](const operator_heartbeat_t& m) {
    if (!operator_.hear(m, port_.now(), supervisor_.moves())) port_.reject();
  });
}

// An estimate moves with the axes, if only by its prediction.
void ControllerNode::check_alive(const needle_state_t& m) {
  if (!std::equal(same_position_mm_.begin(), same_position_mm_.end(), m.position_mm)) {
    std::copy_n(m.position_mm, 3, same_position_mm_.begin());
    same_since_insertion_mm_ = insertion_mm_;
  }
  const double inserted_mm = std::abs(insertion_mm_ - same_since_insertion_mm_);
  if (inserted_mm > kSeenToMove_mm)
    on_trouble({InputTrouble::Kind::implausible,
                io::channel::kNeedleState,
                {"the same position to the last bit after an insertion", inserted_mm, kSeenToMove_mm, "mm"},
                0});
}

// Requests that lead to motion need an operator program that is alive.
bool ControllerNode::is_refused(Word word) {
  if (word != Word::arm && word != Word::arm_to_retract && word != Word::start && word != Word::retract) return false;
  const std::string problem = operator_.problem(port_.now());
  operator_refusal_ =
      problem.empty() ? "" : "request " + std::to_string(static_cast<int>(word)) + " is refused: " + problem;
  operator_refused_ns_ = port_.now().ns;
  return !problem.empty();
}

void ControllerNode::on_word(Word word, const steering_target_t& m) {
  if (is_refused(word)) return;
  if (word == Word::arm || word == Word::arm_to_retract) {
    port_.forget_senders();
    detail_.clear();  // of the stop before: what this arm is refused for is another
  }
  const controller::Target target{{m.position_mm[0], m.position_mm[1], m.position_mm[2]}, m.tolerance_mm, m.utime};
  supervisor_.request(word, target, port_.now().utime);
  if (word == Word::stop) command(0);
}

void ControllerNode::on_trouble(const InputTrouble& trouble) {
  if (trouble.kind == InputTrouble::Kind::clock_step) operator_.restart();
  if (latched(supervisor_.status().state)) return;
  stop(controller::Reason::input_refused, describe(trouble));
}

void ControllerNode::stop(controller::Reason reason, std::string detail) {
  const bool was = latched(supervisor_.status().state);
  supervisor_.report(reason);
  if (was) return;
  detail_ = std::move(detail);
  command(0);
}

// Sends what the supervisor commands now.
void ControllerNode::command(double elapsed_s) {
  port_.publish(io::channel::kMotionCommand, io::to_message(supervisor_.step(port_.now().utime, elapsed_s)));
  const bool is = latched(supervisor_.status().state);
  const bool stopped_now = is && !was_latched_;
  if (!is) detail_.clear();
  was_latched_ = is;
  if (!stopped_now) return;
  status_.renew_session();
  report();
}

// Periods that were missed count too: under load a limit of seconds is one of seconds.
void ControllerNode::command_now() {
  const std::int64_t now_ns = port_.now().ns;
  const double elapsed_s = stepped_ns_ == 0 ? config_.period_s : static_cast<double>(now_ns - stepped_ns_) * 1e-9;
  stepped_ns_ = now_ns;
  command(elapsed_s);
}

void ControllerNode::step(const Now& now, double late_s) {
  port_.tell_time(now);
  port_.rethrow();
  if (late_s > kLateStop_s && supervisor_.moves()) {
    status_.note_overrun();
    stop(controller::Reason::overrun);
  }
  if (status_.name_taken())
    stop(controller::Reason::input_refused, "another bevel-controller is heard on this network");
  if (supervisor_.moves() && !operator_.is_fresh(now))
    stop(controller::Reason::operator_silent, operator_.problem(now));
  // While it moves each estimate is a step of its own, and the period only fills the gaps.
  const bool stepped = supervisor_.moves() && stepped_ns_ != 0 &&
                       static_cast<double>(now.ns - stepped_ns_) * 1e-9 < 0.5 * config_.period_s;
  if (!stepped) command_now();
  report();
}

void ControllerNode::end() {
  stop(controller::Reason::ending);
  report();
}

void ControllerNode::report() {
  const controller::Status& s = supervisor_.status();
  const bool is_health =
      s.reason == controller::Reason::state_unhealthy || (s.reason == controller::Reason::state_reset && s.value != 0);
  std::string reason = is_health ? std::string(controller::to_string(s.reason)) + ": " +
                                       estimator::describe_health(static_cast<std::int32_t>(s.value))
                                 : controller::describe(s);
  if (!detail_.empty()) reason += ": " + detail_;
  const auto add = [&reason](const std::string& remark) {
    if (!remark.empty()) reason += (reason.empty() ? "" : "; ") + remark;
  };
  if (!latched(s.state)) add(words_.refusal());
  if (port_.now().ns - operator_refused_ns_ < kRefusalShown_ns) add(operator_refusal_);
  add(operator_.second_operator(port_.now()));
  status_.report(to_process_state(s.state), reason);
}

}  // namespace bevel::nodes
