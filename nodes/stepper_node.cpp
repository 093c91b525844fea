#include "nodes/stepper_node.hpp"

namespace bevel::nodes {

StepperNode::StepperNode(lcm::LCM& lcm, can::Bus& bus, const stepper::StepperConfig& config)
    : port_(lcm), driver_(bus, config), status_(port_, "bevel-stepper", static_cast<double>(config.period_ns) * 1e-9) {
  port_.subscribe<motion_command_t>(io::channel::kMotionCommand, [this](const motion_command_t& m) {
    // Commands that overtook each other: only a newer one counts. A controller that was started anew begins at 0.
    if (m.utime <= setpoint_utime_ && m.seq <= last_seq_) return;
    setpoint_ = stepper::MotionSetpoint{0, m.mode == 1, m.insertion_rate_mm_s, m.rotation_rate_rad_s};
    setpoint_utime_ = m.utime;
    last_seq_ = m.seq;
  });
  port_.subscribe<steering_target_t>(io::channel::kSteeringTarget,
                                     [this](const steering_target_t& m) { on_target(m); });
}

void StepperNode::on_target(const steering_target_t& target) {
  if (target.request == 0) {
    driver_.request_stop();
    enable_wanted_ = false;
  } else if (target.request == 1) {
    driver_.rearm();
    enable_wanted_ = true;
  }
}

void StepperNode::step(std::int64_t now_ns, std::int64_t now_utime) {
  if (setpoint_) setpoint_->age_ns = (now_utime - setpoint_utime_) * 1000;
  driver_.step(now_ns, setpoint_);
  const stepper::AxesReport report = driver_.report();
  std::string refusal;
  if (enable_wanted_ && report.state == stepper::DriverState::ready) {
    if (!zero_taken_) {
      driver_.set_zero();
      zero_taken_ = true;
    }
    const auto answer = driver_.enable();
    if (answer == stepper::EnableAnswer::accepted) enable_wanted_ = false;
    if (answer == stepper::EnableAnswer::position_not_trusted) refusal = "position not trusted: a drive was lost";
  }
  if (report.sampled_ns > published_ns_) publish(now_ns, now_utime, report);
  const std::string reason = report.stop.reason == stepper::StopReason::none ? refusal : stepper::describe(report.stop);
  status_.report(now_utime, stepper::to_string(report.state), reason);
}

void StepperNode::publish(std::int64_t now_ns, std::int64_t now_utime, const stepper::AxesReport& report) {
  published_ns_ = report.sampled_ns;
  actuator_state_t m{};
  m.utime = now_utime - (now_ns - report.sampled_ns) / 1000;  // the time of the positions, not of sending
  m.seq = seq_++;
  for (std::size_t i = 0; i < 2; ++i) m.axis_status[i] = static_cast<std::int32_t>(report.status[i]);
  m.insertion_mm = report.insertion_mm;
  m.insertion_rate_mm_s = report.insertion_rate_mm_s;
  m.rotation_rad = report.rotation_rad;
  m.rotation_rate_rad_s = report.rotation_rate_rad_s;
  port_.publish(io::channel::kActuatorState, m);
}

}  // namespace bevel::nodes
