// SPDX-License-Identifier: MIT
#include <bevel/controller/supervisor.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <bevel/model/age.hpp>

namespace bevel::controller {
namespace {
constexpr double kDeviations = 4;  // of the estimate's own standard deviation
constexpr double kWayPointTolerance_mm = 1;
}  // namespace

Supervisor::Supervisor(const ControllerConfig& config, const model::NeedleParameters& needle,
                       std::vector<model::ActiveEffect> effects)
    : config_(config),
      needle_(needle),
      axes_(std::move(effects)),
      rendezvous_(config.follow),
      route_(config.obstacles) {}

void Supervisor::stop(Reason reason, double value, const char* unit, const Allowed& allowed) {
  rates_ = {};
  if (status_.state == State::stopped || status_.state == State::fault) return;  // the first reason stays
  status_.state = reason == Reason::state_not_finite || reason == Reason::outside_model ? State::fault : State::stopped;
  status_.reason = reason;
  status_.value = value;
  status_.unit = unit;
  status_.allowed = allowed;
  status_.target_lost = false;
}

void Supervisor::clear_reason() {
  status_.reason = Reason::none;
  status_.value = 0;
  status_.unit = "";
  status_.allowed = {};
  status_.target_lost = false;
  beyond_since_mm_.reset();
}

void Supervisor::request(Request request, const std::optional<Target>& target, std::int64_t now_utime) {
  switch (request) {
    case Request::stop:
      forget_way_points();
      stop(Reason::operator_stop, 0, "");
      return;
    case Request::hold:
      if (moves()) hold(Reason::held);
      resting_.reset();
      return;
    case Request::start:
      if (status_.state != State::armed && status_.state != State::hold) return;
      // Not an error yet: the drives may still be switching on.
      if (!target_ || (status_.state == State::armed && !axes_were_enabled_ && !see_enabled(now_utime))) return;
      if (!check_inputs(now_utime)) return;
      if (!check_axes()) return;
      if (front_is_lost())
        return stop(Reason::channel_unknown, front_->insertion_mm - actuator_->insertion_mm, "mm behind its end");
      if (status_.state == State::hold && !check_reach(now_utime)) return;
      reset_count_ = needle_state_->reset_count;
      arcs_.restart();
      forget_way_points();
      clear_reason();
      status_.state = State::steering;
      return;
    case Request::follow: {
      if (!in_motion_states() || for_retraction_ || !target || !target->position_mm.allFinite() ||
          !check_inputs(now_utime))
        return;
      if (!follow_target(*target, now_utime)) return;
      if (status_.state != State::retracting) check_reach(now_utime);  // which goes nowhere now; seen when it starts
      return;
    }
    case Request::way_point:
      if (!target || !target->position_mm.allFinite()) return;
      if (way_points_.count == kMostWayPoints) {
        way_points_lost_ = true;
        return stop(Reason::way_points_too_many, static_cast<double>(kMostWayPoints), "at most");
      }
      way_points_.add(
          {target->position_mm, target->tolerance_mm > 0 ? target->tolerance_mm : kWayPointTolerance_mm, true});
      is_inside(target->position_mm);  // refused now, and again by an arm: it is kept until it is forgotten
      return;
    case Request::retract:
      return start_retraction(target, now_utime);
    case Request::entry:
    case Request::confirm:
      return;  // for those who count and estimate
    case Request::arm:
    case Request::arm_to_retract:
      break;
  }
  const bool to_retract = request == Request::arm_to_retract;
  if (moves() || (!to_retract && (!target || !target->position_mm.allFinite()))) return;
  status_.state = State::off;  // re-arming is this explicit command, and it clears a latched reason
  clear_reason();
  status_.miss = {};
  rates_ = {};
  for_retraction_ = to_retract;
  if (to_retract) {
    target_.reset();
    if (check_inputs(now_utime)) await_axes();
    return;
  }
  if (way_points_lost_) return stop(Reason::way_points_too_many, static_cast<double>(kMostWayPoints), "at most");
  PathPoints told = way_points_;
  told.add({target->position_mm, config_.safety.target_miss_max_mm, true});
  // Before anything is computed from them: the cost of a prediction grows with the distance.
  for (const PathPoint& point : told.all())
    if (!is_inside(point.at_mm)) return;
  if (!check_inputs(now_utime)) return;
  aim_mm_ = target->position_mm;
  route_.restart(told);
  const double miss_mm = predicted_miss_mm(target->position_mm);
  status_.miss = {miss_mm, 0, target->tolerance_mm > 0 ? target->tolerance_mm : config_.safety.arrival_tolerance_mm};
  if (told.count == 1 && !(miss_mm <= config_.safety.target_miss_max_mm))
    return stop(Reason::target_unreachable, miss_mm, "mm",
                {"predicted miss", 0, config_.safety.target_miss_max_mm,
                 "choose a target within reach, or raise controller.safety.target_miss_max_mm"});
  if (route_.is_needed()) {
    if (config_.law != Law::arcs) return stop(Reason::law_without_path, 0, "");
    if (route_.plan(path_start()) == Route::Way::blocked) return stop_without_path();
  }
  target_ = target;
  was_outside_ = false;
  rendezvous_.restart(target->utime_or(now_utime), target->position_mm);
  await_axes();
}

void Supervisor::await_axes() {
  status_.state = State::armed;
  axes_were_enabled_ = false;
  enabling_s_ = 0;
  followed_utime_.reset();
  commands_.restart();
  resting_.reset();
}

// Everything that must hold for motion; latches the first thing that does not.
bool Supervisor::check_inputs(std::int64_t now_utime) {
  const SafetyLimits& safety = config_.safety;
  const auto age_s = [now_utime](std::int64_t utime) { return model::age_s(now_utime, utime); };
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
  // In motion a reset is the cause, and an estimate that is uncertain after it the consequence.
  if (moves() && !check_reset()) return false;
  if (n.health != 0) return refuse(Reason::state_unhealthy, n.health, "(health word)");
  if (!(n.position_variance_mm2 <= safety.position_sd_mm * safety.position_sd_mm))
    return refuse(Reason::state_uncertain, std::sqrt(n.position_variance_mm2), "mm standard deviation");
  if (!actuator_) return refuse(Reason::actuator_stale, 0, "none yet");
  if (!(std::abs(age_s(actuator_->utime)) <= safety.actuator_age_s))
    return refuse(Reason::actuator_stale, age_s(actuator_->utime), "s old");
  const double depth = n.pose.p_mm.z();
  if (!(depth >= safety.depth_min_mm && (for_retraction_ || depth <= safety.depth_max_mm)))
    return refuse_outside(depth, {"z of the tip", safety.depth_min_mm, safety.depth_max_mm,
                                  "arm for a retraction (request 9), or raise controller.safety.depth_max_mm"});
  const double left_mm = route_.clearance_left_mm(n.pose.p_mm), lateral = n.pose.p_mm.head<2>().norm();
  // Back along the way that it came leads out of both.
  if (!for_retraction_ && left_mm < 0) return refuse(Reason::obstacle_near, left_mm, "mm of its clearance left");
  if (!for_retraction_ && !(lateral <= safety.lateral_max_mm))
    return refuse_outside(lateral, {"distance of the tip from the z axis", 0, safety.lateral_max_mm,
                                    "arm for a retraction (request 9), or raise controller.safety.lateral_max_mm"});
  // Tissue that moves with its camera, and an entry point that was not quite met, are within the bound on the error.
  const double beyond = n.pose.p_mm.norm() - std::abs(actuator_->insertion_mm);
  if (!(beyond <= safety.position_sd_mm + kDeviations * std::sqrt(n.position_variance_mm2)))
    return refuse(Reason::off_the_axes, beyond, "mm too far");
  return true;
}

bool Supervisor::refuse_outside(double value, const Allowed& allowed) {
  stop(Reason::workspace, value, "mm", allowed);
  return false;
}

// Of the target where it will be; with a route the whole path is looked at, in the next period.
bool Supervisor::check_reach(std::int64_t now_utime) {
  rendezvous_.plan(now_utime, to_go_mm(), config_.limits.insertion_rate_mm_s);
  if (route_.is_needed()) return true;
  // A prediction that is hardly one yet is no reason.
  const double allowed_mm = config_.safety.target_miss_max_mm + kTargetDeviations * rendezvous_.target_sd_mm();
  const double miss_mm = predicted_miss_mm(rendezvous_.target_mm());
  if (miss_mm <= allowed_mm) return true;
  stop(Reason::target_unreachable, miss_mm, "mm",
       {"predicted miss", 0, allowed_mm, "retract and arm again, or raise controller.safety.target_miss_max_mm"});
  return false;
}

bool Supervisor::all_enabled() const {
  return std::ranges::all_of(actuator_->axis_status, [](std::int32_t axis) {
    return axis == static_cast<std::int32_t>(model::AxisStatus::enabled);
  });
}

bool Supervisor::see_enabled(std::int64_t now_utime) {
  const bool fresh = std::abs(model::age_s(now_utime, actuator_->utime)) <= config_.safety.actuator_age_s &&
                     std::abs(model::age_s(now_utime, needle_state_->utime)) <= config_.safety.state_age_s;
  axes_were_enabled_ = fresh && all_enabled();
  return axes_were_enabled_;
}

// Armed a moment ago, drives are being reset, configured and switched on, and what is known of the axes is of before:
// nothing can move, so there is nothing to judge, but not for ever.
bool Supervisor::waits_for_axes(std::int64_t now_utime, double elapsed_s) {
  if (status_.state != State::armed || axes_were_enabled_ || see_enabled(now_utime)) return false;
  enabling_s_ += elapsed_s;
  if (enabling_s_ <= config_.safety.enabling_s) return true;
  stop(Reason::axes_not_enabled, enabling_s_, "s after arming");
  return true;
}

bool Supervisor::check_axes() {
  if (all_enabled()) return true;
  const auto& axes = actuator_->axis_status;
  const bool first = axes[0] != static_cast<std::int32_t>(model::AxisStatus::enabled);
  stop(Reason::axes_not_enabled, first ? axes[0] : axes[1], first ? "(status of insertion)" : "(status of rotation)");
  return false;
}

// The axes do what they were told.
bool Supervisor::check_tracking() {
  const SafetyLimits& safety = config_.safety;
  const Rates excess = commands_.excess(*actuator_, safety.axis_delay_s);
  const bool follow =
      excess.insertion_mm_s <= safety.tracking_error_mm_s && excess.rotation_rad_s <= safety.tracking_error_rad_s;
  if (follow || !followed_utime_) followed_utime_ = actuator_->utime;
  if (model::age_s(actuator_->utime, *followed_utime_) <= safety.tracking_error_s) return true;
  excess.insertion_mm_s > safety.tracking_error_mm_s
      ? stop(Reason::insertion_tracking, excess.insertion_mm_s, "mm/s off")
      : stop(Reason::rotation_tracking, excess.rotation_rad_s, "rad/s off");
  return false;
}

// What was told to rest rests: axes by their positions, which catches what is too slow for rates, and the estimate.
bool Supervisor::check_rest(std::int64_t now_utime) {
  const SafetyLimits& safety = config_.safety;
  if (!axes_were_enabled_) return true;
  if (!commands_.told_to_rest(now_utime, 2 * safety.axis_delay_s)) {
    resting_.reset();
    return true;
  }
  if (!resting_) resting_ = Resting{actuator_->insertion_mm, actuator_->rotation_rad, needle_state_->pose.p_mm};
  const double moved_mm = std::abs(actuator_->insertion_mm - resting_->insertion_mm);
  const double turned_rad = std::abs(actuator_->rotation_rad - resting_->rotation_rad);
  const double tip_mm = (needle_state_->pose.p_mm - resting_->tip_mm).norm();
  if (!(moved_mm <= safety.resting_motion_mm)) return stop(Reason::resting_axes_moved, moved_mm, "mm"), false;
  if (!(turned_rad <= safety.resting_motion_rad)) return stop(Reason::resting_axes_moved, turned_rad, "rad"), false;
  // Tissue relaxes and breathes: only what could not be that.
  const double room_mm = safety.position_sd_mm + kDeviations * std::sqrt(needle_state_->position_variance_mm2);
  if (!(tip_mm <= room_mm)) return stop(Reason::resting_tip_moved, tip_mm, "mm"), false;
  return true;
}

bool Supervisor::watch(std::int64_t now_utime) {
  const bool enabling = status_.state == State::armed && !axes_were_enabled_;
  return !in_motion_states() || enabling || check_inputs(now_utime);
}

model::MotionCommand Supervisor::step(std::int64_t now_utime, double elapsed_s) {
  const double dt_s = std::min(elapsed_s, config_.period_s);
  model::MotionCommand command;
  command.utime = now_utime;
  command.seq = seq_++;
  if (!in_motion_states()) {
    rates_ = {};
    return command;
  }
  if (waits_for_axes(now_utime, elapsed_s)) return command;
  if (!check_inputs(now_utime) || !check_axes() || !check_tracking()) return command;
  note_front();
  if (!moves()) {
    rates_ = ramp(rates_, {}, dt_s, config_.limits);
    if (!check_rest(now_utime)) return command;
    settle(now_utime);
    commands_.remember(now_utime, rates_);
    command.mode = status_.state == State::hold ? 1 : 0;
    command.insertion_rate_mm_s = rates_.insertion_mm_s;
    command.rotation_rate_rad_s = rates_.rotation_rad_s;
    return command;
  }
  resting_.reset();
  if (status_.state == State::retracting) return retract(command, dt_s);
  rendezvous_.plan(now_utime, to_go_mm(), config_.limits.insertion_rate_mm_s);
  if (!see_path(elapsed_s)) return command;
  if (!see_geometry()) {
    stop(Reason::outside_model, model::tilt_rad(needle_state_->pose), "rad tilt");
    return command;
  }
  const double ahead_mm = by_arcs() ? status_.arc.ahead_mm : status_.geometry.ahead_mm;
  Rates wanted;
  if (pauses_for_path_ || needle_state_->unsure) {
    // Nothing is inserted until there is a path, and readings are believed.
  } else if (insertion_left_mm(ahead_mm) <= 0) {  // closest approach: what still turns comes to rest by the ramp
    hold(Reason::coming_to_rest);
    met_mm_ = rendezvous_.target_mm(), met_sd_mm_ = rendezvous_.target_sd_mm();
  } else {
    wanted = steer(now_utime);
  }
  if (moves() && !pauses_for_path_ && !needle_state_->unsure && !check_miss()) return command;
  return run(command, wanted, dt_s);
}

// By the ramps, toward what is wanted.
model::MotionCommand Supervisor::run(model::MotionCommand command, const Rates& wanted, double dt_s) {
  rates_ = ramp(rates_, wanted, dt_s, config_.limits);
  commands_.remember(command.utime, rates_);
  command.mode = 1;
  command.insertion_rate_mm_s = rates_.insertion_mm_s;
  command.rotation_rate_rad_s = rates_.rotation_rad_s;
  return command;
}

bool Supervisor::check_reset() {
  if (needle_state_->reset_count == reset_count_) return true;
  stop(Reason::state_reset, needle_state_->reset_cause, "(health word)");
  return false;
}

}  // namespace bevel::controller
