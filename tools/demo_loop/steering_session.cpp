// SPDX-License-Identifier: MIT
#include "tools/demo_loop/steering_session.hpp"

#include <cstdio>

#include <bevel/controller/supervisor.hpp>
#include <bevel/error.hpp>
#include <bevel/estimator/health.hpp>

namespace bevel::tools {
namespace {
constexpr std::int64_t kWordPeriod_ns = 300'000'000;
constexpr std::int64_t kPrintPeriod_ns = 2'000'000'000;
constexpr std::int64_t kSettle_ns = 500'000'000;
constexpr double kThere_mm = 0.1;  // of the depth to be drawn back to: what the controller holds at, and its ramp

bool opens_with(const std::string& text, controller::Reason reason) {
  return text.starts_with(controller::to_string(reason));
}

bool refuses_the_target(const std::string& text) {
  for (int i = 0; i <= static_cast<int>(controller::Reason::retracted); ++i)
    if (const auto reason = static_cast<controller::Reason>(i); controller::refuses_target(reason))
      if (opens_with(text, reason)) return true;
  return false;
}

}  // namespace

bool reports_arrival(const std::string& reason) { return opens_with(reason, controller::Reason::arrived); }
bool reports_miss(const std::string& reason) { return opens_with(reason, controller::Reason::missed); }

SteeringSession::SteeringSession(lcm::LCM& lcm, const std::string& log_path, const Eigen::Vector3d& target_mm,
                                 double tolerance_mm, std::optional<double> retract_to_mm)
    : lcm_(lcm),
      port_(lcm),
      heartbeat_(port_),
      log_(log_path),
      target_mm_(target_mm),
      tolerance_mm_(tolerance_mm),
      retract_to_mm_(retract_to_mm) {
  everything_ = lcm_.subscribe(".*", &SteeringSession::on_any, this);
  everything_->setQueueCapacity(2000);
  port_.subscribe<process_status_t>(io::channel::kProcessStatus,
                                    [this](const process_status_t& m) { processes_[m.process] = m; });
  port_.subscribe<needle_state_t>(io::channel::kNeedleState, [this](const needle_state_t& m) { estimate_ = m; });
  port_.subscribe<needle_state_t>(io::channel::kNeedleTruth, [this](const needle_state_t& m) { truth_ = m; });
  port_.subscribe<actuator_state_t>(io::channel::kActuatorState,
                                    [this](const actuator_state_t& m) { inserted_mm_ = m.insertion_mm; });
}

SteeringSession::~SteeringSession() { lcm_.unsubscribe(everything_); }

void SteeringSession::on_any(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
  if (!log_failure_.empty()) return;
  try {
    log_.write(buffer->recv_utime, channel, {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
  } catch (const std::exception& e) {
    log_failure_ = e.what();
  }
}

void SteeringSession::say(nodes::Word word) { say(word, target_mm_); }

void SteeringSession::say(nodes::Word word, const Eigen::Vector3d& position_mm) {
  steering_target_t m{};
  m.utime = nodes::now().utime;
  m.seq = seq_++;
  m.request = static_cast<std::int32_t>(word);
  m.tolerance_mm = tolerance_mm_;
  for (int i = 0; i < 3; ++i) m.position_mm[i] = position_mm[i];
  const char* const receivers[] = {"bevel-controller", "bevel-stepper", "bevel-estimator"};  // as nodes::Receiver
  for (int i = 0; i < 3; ++i) m.session[i] = session_of(receivers[i]);
  port_.publish(io::channel::kSteeringTarget, m);
}

void SteeringSession::stop() { say(nodes::Word::stop); }

void SteeringSession::close_log() {
  if (!log_failure_.empty()) throw IoError(log_failure_);
  log_.close();
}

std::int64_t SteeringSession::session_of(const std::string& process) const {
  const auto found = processes_.find(process);
  return found == processes_.end() ? 0 : found->second.session;
}

std::optional<io::ProcessState> SteeringSession::state_of(const std::string& process) const {
  const auto found = processes_.find(process);
  if (found == processes_.end()) return std::nullopt;
  return static_cast<io::ProcessState>(found->second.state_code);
}

std::string SteeringSession::state_text(const std::string& process) const {
  const auto state = state_of(process);
  return state ? io::to_string(*state) : "no status";
}

std::string SteeringSession::reason() const {
  std::string text;
  for (const auto& [name, status] : processes_)
    text += (text.empty() ? "" : "; ") + name + " " + status.state +
            (status.reason.empty() ? "" : " (" + status.reason + ")");
  return text.empty() ? "no process was heard of" : text;
}

SteeringSession::Progress SteeringSession::step(const nodes::Now& now) {
  if (start_ns_ == 0) start_ns_ = now.ns;
  if (!log_failure_.empty()) return Progress::stopped;
  heartbeat_.beat();
  print_progress(now);
  using io::ProcessState;
  const auto controller = state_of("bevel-controller");
  if (steering_seen_ && controller == ProcessState::hold) {
    const std::string& outcome = processes_["bevel-controller"].reason;
    if (reports_arrival(outcome) || reports_miss(outcome)) outcome_ = outcome;
    if (outcome_.empty()) return Progress::going_on;  // not at rest yet
    if (at_depth_ns_ == 0) at_depth_ns_ = now.ns;
    if (now.ns - at_depth_ns_ <= kSettle_ns) return Progress::going_on;
    return retract_to_mm_ ? draw_back(now) : Progress::at_depth;
  }
  if (controller == ProcessState::retracting && !retracting_seen_) {
    retracting_seen_ = true;
    at_depth_ns_ = 0;  // counted anew when it holds again
  }
  if (controller == ProcessState::steering) steering_seen_ = true;
  if (controller == ProcessState::stopped || controller == ProcessState::fault) {
    // Before the start most reasons pass, and the commands are repeated; the refusal of a target does not pass.
    if (steering_seen_ || refuses_the_target(processes_["bevel-controller"].reason)) return Progress::stopped;
  }
  if (steering_seen_ || now.ns < next_word_ns_) return Progress::going_on;
  // The operator's words, repeated until they take effect.
  next_word_ns_ = now.ns + kWordPeriod_ns;
  const auto stepper = state_of("bevel-stepper");
  const bool seen = estimate_ && estimator::lost(estimate_->health) == 0;
  if (controller == ProcessState::armed && stepper == ProcessState::enabled) {
    say(nodes::Word::start);
  } else if (seen && controller != ProcessState::armed &&
             (stepper == ProcessState::ready || stepper == ProcessState::enabled)) {
    say(nodes::Word::arm);
  }
  return Progress::going_on;
}

// It holds: at the target, or where it was to be drawn back to.
SteeringSession::Progress SteeringSession::draw_back(const nodes::Now& now) {
  // A way that is short may be over before a status has told of it.
  if (retracting_seen_ || (inserted_mm_ && *inserted_mm_ <= *retract_to_mm_ + kThere_mm)) return Progress::at_depth;
  if (now.ns < next_word_ns_) return Progress::going_on;
  next_word_ns_ = now.ns + kWordPeriod_ns;
  say(nodes::Word::retract, {0, 0, *retract_to_mm_});
  return Progress::going_on;
}

void SteeringSession::print_progress(const nodes::Now& now) {
  if (now.ns < next_print_ns_) return;
  next_print_ns_ = now.ns + kPrintPeriod_ns;
  const double t = static_cast<double>(now.ns - start_ns_) * 1e-9;
  std::printf("%5.1f s  controller %-12s axes %-12s", t, state_text("bevel-controller").c_str(),
              state_text("bevel-stepper").c_str());
  if (estimate_) {
    const Eigen::Vector3d at(estimate_->position_mm[0], estimate_->position_mm[1], estimate_->position_mm[2]);
    std::printf(" tip %6.1f %6.1f %6.1f mm  to go %5.1f mm", at.x(), at.y(), at.z(), (target_mm_ - at).norm());
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace bevel::tools
