#include "controller/supervisor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bevel::controller {

const char* to_string(State state) {
  switch (state) {
    case State::off:
      return "off";
    case State::armed:
      return "armed";
    case State::steering:
      return "steering";
    case State::hold:
      return "hold";
    case State::stopped:
      return "stopped";
    case State::fault:
      return "fault";
  }
  return "?";
}

const char* to_string(Reason reason) {
  switch (reason) {
    case Reason::none:
      return "";
    case Reason::operator_stop:
      return "stopped by the operator";
    case Reason::state_stale:
      return "needle state stale or missing";
    case Reason::state_unhealthy:
      return "needle state unhealthy";
    case Reason::state_uncertain:
      return "needle position too uncertain";
    case Reason::state_reset:
      return "the estimator declared a reset";
    case Reason::state_not_finite:
      return "needle state not finite";
    case Reason::actuator_stale:
      return "actuator state stale or missing";
    case Reason::axes_not_enabled:
      return "axes not enabled";
    case Reason::tracking_error:
      return "axes do not follow the command";
    case Reason::workspace:
      return "tip outside the workspace";
    case Reason::target_unreachable:
      return "target out of reach";
    case Reason::outside_model:
      return "tip outside the model's domain";
    case Reason::overrun:
      return "control loop too late";
  }
  return "?";
}

Supervisor::Supervisor(const ControllerConfig& config, const model::NeedleParameters& needle,
                       std::vector<model::ActiveEffect> effects)
    : config_(config), needle_(needle), axes_(std::move(effects)) {}

model::NeedleParameters Supervisor::needle_now() const {
  model::NeedleParameters needle = needle_;
  needle.curvature_per_mm = needle_state_->curvature_per_mm;
  needle.lambda1_per_rad = needle_state_->lambda1_per_rad;
  needle.lambda2 = needle_state_->lambda2;
  return needle;
}

void Supervisor::stop(Reason reason, double value, const char* unit) {
  rates_ = {};
  if (status_.state == State::stopped || status_.state == State::fault) return;  // the first reason stays
  status_.state = reason == Reason::state_not_finite || reason == Reason::outside_model ? State::fault : State::stopped;
  status_.reason = reason;
  status_.value = value;
  status_.unit = unit;
}

void Supervisor::request(Request request, const std::optional<Target>& target, std::int64_t now_utime) {
  switch (request) {
    case Request::stop:
      stop(Reason::operator_stop, 0, "");
      return;
    case Request::hold:
      if (status_.state == State::steering) status_.state = State::hold;
      return;
    case Request::start:
      if (status_.state != State::armed && status_.state != State::hold) return;
      if (!target_ || !check_inputs(now_utime)) return;
      for (const auto axis : actuator_->axis_status)  // not an error yet: the drives may still be switching on
        if (axis != static_cast<std::int32_t>(model::AxisStatus::enabled)) return;
      reset_count_ = needle_state_->reset_count;
      tracking_bad_s_ = 0;
      status_.state = State::steering;
      return;
    case Request::arm:
      break;
  }
  if (status_.state == State::steering || !target || !target->position_mm.allFinite()) return;
  status_.state = State::off;  // re-arming is this explicit word, and it clears a latched reason
  status_.reason = Reason::none;
  status_.value = 0;
  status_.unit = "";
  rates_ = {};
  if (!check_inputs(now_utime)) return;
  const Reach reach =
      predict_reach(needle_state_->pose, needle_now(), target->position_mm, config_.safety.target_miss_max_mm);
  status_.predicted_miss_mm = reach.miss_mm;
  if (!reach.reachable) return stop(Reason::target_unreachable, reach.miss_mm, "mm predicted miss");
  target_ = target;
  status_.state = State::armed;
}

// Everything that must hold for motion; latches the first thing that does not.
bool Supervisor::check_inputs(std::int64_t now_utime) {
  const SafetyLimits& safety = config_.safety;
  const auto age_s = [now_utime](std::int64_t utime) { return static_cast<double>(now_utime - utime) * 1e-6; };
  const auto refuse = [this](Reason reason, double value, const char* unit) {
    stop(reason, value, unit);
    return false;
  };
  if (!needle_state_) return refuse(Reason::state_stale, 0, "none yet");
  const NeedleView& n = *needle_state_;
  // A time from the future is as wrong as an old one: both mean that clocks do not agree.
  if (!(std::abs(age_s(n.utime)) <= safety.state_age_s)) return refuse(Reason::state_stale, age_s(n.utime), "s old");
  if (!(n.pose.p_mm.allFinite() && n.pose.R.allFinite() && std::isfinite(n.curvature_per_mm) &&
        std::isfinite(n.lambda1_per_rad) && std::isfinite(n.lambda2)))
    return refuse(Reason::state_not_finite, 0, "");
  if (n.health != 0) return refuse(Reason::state_unhealthy, n.health, "(health word)");
  if (!(n.position_variance_mm2 <= safety.position_sd_mm * safety.position_sd_mm))
    return refuse(Reason::state_uncertain, std::sqrt(n.position_variance_mm2), "mm standard deviation");
  if (!actuator_) return refuse(Reason::actuator_stale, 0, "none yet");
  if (!(std::abs(age_s(actuator_->utime)) <= safety.actuator_age_s))
    return refuse(Reason::actuator_stale, age_s(actuator_->utime), "s old");
  const double depth = n.pose.p_mm.z();
  if (!(depth >= safety.depth_min_mm && depth <= safety.depth_max_mm))
    return refuse(Reason::workspace, depth, "mm deep");
  const double lateral = n.pose.p_mm.head<2>().norm();
  if (!(lateral <= safety.lateral_max_mm)) return refuse(Reason::workspace, lateral, "mm lateral");
  return true;
}

bool Supervisor::check_tracking(double dt_s) {
  const SafetyLimits& safety = config_.safety;
  for (const auto axis : actuator_->axis_status)
    if (axis != static_cast<std::int32_t>(model::AxisStatus::enabled)) {
      stop(Reason::axes_not_enabled, axis, "(axis status)");
      return false;
    }
  const double insertion = std::abs(actuator_->insertion_rate_mm_s - rates_.insertion_mm_s);
  const double rotation = std::abs(actuator_->rotation_rate_rad_s - rates_.rotation_rad_s);
  const bool bad = !(insertion <= safety.tracking_error_mm_s && rotation <= safety.tracking_error_rad_s);
  tracking_bad_s_ = bad ? tracking_bad_s_ + dt_s : 0;
  if (tracking_bad_s_ <= safety.tracking_error_s) return true;
  insertion > safety.tracking_error_mm_s ? stop(Reason::tracking_error, insertion, "mm/s off")
                                         : stop(Reason::tracking_error, rotation, "rad/s off");
  return false;
}

model::MotionCommand Supervisor::step(std::int64_t now_utime, double dt_s) {
  model::MotionCommand command;
  command.utime = now_utime;
  command.seq = seq_++;
  if (status_.state != State::steering) {
    rates_ = {};
    return command;
  }
  if (!check_inputs(now_utime) || !check_tracking(dt_s)) return command;
  if (needle_state_->reset_count != reset_count_) {
    stop(Reason::state_reset, needle_state_->reset_count, "resets");
    return command;
  }
  status_.geometry = steering_geometry(needle_state_->pose, needle_now(), target_->position_mm,
                                       config_.limits.insertion_rate_mm_s, config_.gains.parameter_uncertainty);
  if (!status_.geometry.in_domain) {
    stop(Reason::outside_model, model::tilt_rad(needle_state_->pose), "rad tilt");
    return command;
  }
  if (status_.geometry.ahead_mm <= 0) {  // closest approach
    status_.state = State::hold;
    rates_ = {};
    return command;
  }
  const double tolerance_mm = target_->tolerance_mm > 0 ? target_->tolerance_mm : config_.gains.tolerance_mm;
  Rates wanted = steering_rates(status_.geometry, actuator_->rotation_rad, tolerance_mm, config_);
  if (axes_.turns_late()) {
    const double share = std::min(1.0, std::abs(status_.geometry.sigma_rad) / config_.gains.boundary_layer_rad);
    wanted.rotation_rad_s =
        base_rate_rad_s(wanted.rotation_rad_s, axes_.take_up_rad(wanted.rotation_rad_s), share, config_.limits);
  }
  // Come to rest at the closest approach: never faster than the ramp can stop within what is left.
  const double braking = std::sqrt(2 * 0.5 * config_.limits.insertion_acceleration_mm_s2 * status_.geometry.ahead_mm);
  wanted.insertion_mm_s = std::min(wanted.insertion_mm_s, braking);
  rates_ = ramp(rates_, wanted, dt_s, config_.limits);
  status_.predicted_miss_mm = status_.geometry.aim_mm.norm();
  command.mode = 1;
  command.insertion_rate_mm_s = rates_.insertion_mm_s;
  command.rotation_rate_rad_s = rates_.rotation_rad_s;
  return command;
}

}  // namespace bevel::controller
