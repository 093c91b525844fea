// SPDX-License-Identifier: MIT
#include <bevel/nodes/stepper_node.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::nodes {
namespace {

// At a start nearer to the drives' own zero than this, nothing has been inserted yet.
constexpr double kAtZero_mm = 0.5;
constexpr double kAtZero_rad = 0.1;
constexpr double kFastestController_hz = 600;  // controller.period_s is at least 2 ms

io::SenderLimits command_limits(const stepper::StepperConfig& config) {
  return {.longest_age_us = config.setpoint_stop_age_ns / 1000,
          .longest_ahead_us = config.period_ns / 1000,
          .fastest_hz = kFastestController_hz,
          .silence_us = config.setpoint_stop_age_ns / 1000};
}

bool is_latched(const stepper::AxesReport& report) {
  return report.state == stepper::DriverState::stopped || report.state == stepper::DriverState::fault;
}

io::ProcessState to_process_state(stepper::DriverState state) {
  switch (state) {
    case stepper::DriverState::off:
      return io::ProcessState::off;
    case stepper::DriverState::configuring:
      return io::ProcessState::configuring;
    case stepper::DriverState::ready:
      return io::ProcessState::ready;
    case stepper::DriverState::enabled:
      return io::ProcessState::enabled;
    case stepper::DriverState::stopped:
      return io::ProcessState::stopped;
    case stepper::DriverState::fault:
      return io::ProcessState::fault;
  }
  return io::ProcessState::fault;
}

// ACTUATOR_STATE carries the driver's numbers; readers use the model's.
static_assert(static_cast<int>(stepper::AxisStatus::off) == static_cast<int>(model::AxisStatus::off));
static_assert(static_cast<int>(stepper::AxisStatus::ready) == static_cast<int>(model::AxisStatus::ready));
static_assert(static_cast<int>(stepper::AxisStatus::enabled) == static_cast<int>(model::AxisStatus::enabled));
static_assert(static_cast<int>(stepper::AxisStatus::quick_stop) == static_cast<int>(model::AxisStatus::quick_stop));
static_assert(static_cast<int>(stepper::AxisStatus::fault) == static_cast<int>(model::AxisStatus::fault));
static_assert(io::last_code<stepper::AxisStatus>() == io::last_code<model::AxisStatus>());

}  // namespace

StepperNode::StepperNode(lcm::LCM& lcm, can::Bus& bus, const stepper::StepperConfig& config)
    : config_(config),
      port_(lcm),
      driver_(bus, config),
      status_(port_, "bevel-stepper", static_cast<double>(config.period_ns) * 1e-9),
      words_(port_, status_, Receiver::stepper, [this](Word word, const steering_target_t&) { on_word(word); }) {
  port_.on_trouble = [this](const InputTrouble& trouble) { on_trouble(trouble); };
  port_.subscribe<motion_command_t>(io::channel::kMotionCommand, command_limits(config),
                                    [this](const motion_command_t& m) { on_command(m); });
  // A second way for a stop, should the first be what is broken.
  port_.subscribe<process_status_t>(io::channel::kProcessStatus, [this](const process_status_t& m) {
    // A controller whose needle is at rest already is stopped too. A status from before the arm request is ignored.
    if (m.process == "bevel-controller" && io::is_latched_stop(m.state_code) && (driver_.moving() || ran_since_armed_))
      stop(stepper::StopReason::controller_stop);
  });
}

void StepperNode::on_command(const motion_command_t& m) {
  // Its age now, by the wall clock; from here on by the steady one.
  const std::int64_t age_us = std::max<std::int64_t>(model::age_us(port_.now().utime, m.utime), 0);
  setpoint_made_ns_ = port_.now().ns - age_us * 1000;  // the watch has bounded the age
  const bool ran = setpoint_ && setpoint_->run;
  const bool run_wanted = m.mode == static_cast<std::int32_t>(model::MotionMode::run);
  ran_since_armed_ = ran_since_armed_ || run_wanted;
  setpoint_ = stepper::MotionSetpoint{0, run_wanted, m.insertion_rate_mm_s, m.rotation_rate_rad_s};
  // A stop does not wait for the next cycle.
  if (ran && !setpoint_->run && driver_.moving()) return stop(stepper::StopReason::controller_stop);
  setpoint_->age_ns = age_us * 1000;
  driver_.take(port_.now().ns, *setpoint_);
  note_latch();
}

void StepperNode::on_word(Word word) {
  switch (word) {
    case Word::stop:
      stop(stepper::StopReason::operator_stop);
      enable_wanted_ = false;
      break;
    case Word::arm:
    case Word::arm_to_retract:
      port_.forget_senders();
      driver_.rearm();
      ran_since_armed_ = false;
      enable_wanted_ = true;
      refusal_.clear();
      break;
    case Word::entry:
      if (driver_.report().state == stepper::DriverState::enabled) break;  // not while something may move
      driver_.set_zero();
      zero_known_ = true;
      break;
    case Word::confirm:
      driver_.confirm_position();
      zero_known_ = true;
      break;
    case Word::start:
    case Word::hold:
    case Word::follow:
    case Word::way_point:
    case Word::retract:
      break;  // the controller's
  }
}

void StepperNode::on_trouble(const InputTrouble& trouble) {
  stop(stepper::StopReason::input_refused, describe(trouble));
}

void StepperNode::stop(stepper::StopReason reason, std::string detail) {
  if (is_latched(driver_.report())) return;
  driver_.stop_now(reason, port_.now().ns);
  note_latch();
  if (driver_.report().stop.reason == reason) detail_ = std::move(detail);  // else a drive had one of its own first
}

void StepperNode::note_latch() {
  const bool latched = is_latched(driver_.report());
  if (latched && !was_latched_) {
    status_.renew_session();
    enable_wanted_ = false;
  }
  if (!latched) detail_.clear();
  was_latched_ = latched;
}

void StepperNode::enable_if_wanted(const stepper::AxesReport& report) {
  if (!enable_wanted_ || report.state != stepper::DriverState::ready) return;
  if (!zero_known_ && std::abs(report.insertion_mm) < kAtZero_mm && std::abs(report.rotation_rad) < kAtZero_rad) {
    driver_.set_zero();
    zero_known_ = true;
  }
  if (!zero_known_) {
    refusal_ = "axes stand off their zero and were not watched since the entry: retract and say entry, or confirm";
    enable_wanted_ = false;
    return;
  }
  switch (driver_.enable()) {
    case stepper::EnableAnswer::accepted:
      refusal_.clear();
      enable_wanted_ = false;
      break;
    case stepper::EnableAnswer::position_not_trusted:
      refusal_ = "a drive was lost, its position is not trusted: retract and say entry, or confirm";
      enable_wanted_ = false;
      break;
    case stepper::EnableAnswer::not_ready:
      break;
  }
}

void StepperNode::hear_bus(const Now& now) {
  tell_time(now);
  driver_.receive(now.ns);
  note_latch();
}

void StepperNode::step(const Now& now) {
  port_.tell_time(now);
  port_.rethrow();
  if (status_.name_taken()) stop(stepper::StopReason::input_refused, "another bevel-stepper is heard on this network");
  if (setpoint_) setpoint_->age_ns = model::difference_saturated(now.ns, setpoint_made_ns_);
  driver_.step(now.ns, setpoint_);
  const stepper::AxesReport report = driver_.report();
  enable_if_wanted(report);
  note_latch();
  if (report.sampled_ns > published_ns_) publish(report);
  status_.report(to_process_state(report.state), reason(report));
}

std::string StepperNode::reason(const stepper::AxesReport& report) const {
  const std::string text = stepper::describe(report);
  if (text.empty()) return refusal_.empty() ? words_.refusal() : refusal_;
  return text + (detail_.empty() ? "" : ": " + detail_);
}

void StepperNode::end() { stop(stepper::StopReason::ending); }

bool StepperNode::at_rest() const {
  return std::ranges::all_of(driver_.report().rest,
                             [](stepper::AxisRest rest) { return rest == stepper::AxisRest::at_rest; });
}

void StepperNode::publish(const stepper::AxesReport& report) {
  published_ns_ = report.sampled_ns;
  actuator_state_t m{};
  // The time of the positions, not of sending.
  m.utime = port_.now().utime - (port_.now().ns - report.sampled_ns) / 1000;
  m.seq = seq_++;
  for (std::size_t i = 0; i < 2; ++i) m.axis_status[i] = static_cast<std::int32_t>(report.status[i]);
  m.insertion_mm = report.insertion_mm;
  m.insertion_rate_mm_s = report.insertion_rate_mm_s;
  m.rotation_rad = report.rotation_rad;
  m.rotation_rate_rad_s = report.rotation_rate_rad_s;
  port_.publish(io::channel::kActuatorState, m);
}

}  // namespace bevel::nodes
