// SPDX-License-Identifier: MIT
// What the supervisor steers by, and the rates that the law wants.
#include <algorithm>
#include <cmath>

#include <bevel/controller/supervisor.hpp>

namespace bevel::controller {
namespace {
constexpr double kOutsideModel_mm = -1e8;  // a slack that stands for none (path_plan.cpp)
constexpr double kPathDeviations = 2;      // of the tip's estimate, kept from the obstacles
}  // namespace

model::NeedleParameters Supervisor::needle_now() const {
  model::NeedleParameters needle = needle_;
  needle.curvature_per_mm = needle_state_->curvature_per_mm;
  needle.lambda1_per_rad = needle_state_->lambda1_per_rad;
  needle.lambda2 = needle_state_->lambda2;
  return needle;
}

ShaftConfig Supervisor::shaft_now() const {
  ShaftConfig shaft = config_.shaft;
  if (needle_state_->bending_mm > 0) shaft.bending_mm = needle_state_->bending_mm;
  return shaft;
}

bool Supervisor::by_half_turns() const { return config_.law == Law::flip && actuator_->insertion_mm > kOutside_mm; }

// If the law steers on from here. A target behind the tip is missed by its distance.
double Supervisor::predicted_miss_mm(const Eigen::Vector3d& target_mm) const {
  const model::Pose tip = cutting_tip();
  const ArcGeometry arc = arc_geometry(tip, needle_now(), shaft_now(), target_mm);
  return arc.in_domain && arc.ahead_mm <= 0 ? (target_mm - tip.p_mm).norm() : arc_miss_mm(arc, by_half_turns());
}

// To the plane through the target across the needle.
double Supervisor::to_go_mm() const {
  const model::Pose tip = cutting_tip();
  return drawn_back_mm() + tip.R.col(2).dot(rendezvous_.target_mm() - tip.p_mm);
}

double Supervisor::insertion_left_mm(double ahead_mm) const {
  if (route_.is_needed() && !route_.aims_at_target()) return ahead_mm;
  return axes_.insertion_to_nearest_mm(ahead_mm);
}

PathStart Supervisor::path_start() const {
  PathStart start{cutting_tip(), needle_now(), shaft_now()};
  start.margin_mm = kPathDeviations * std::sqrt(needle_state_->position_variance_mm2) +
                    kLeaves * std::abs(needle_state_->curvature_per_mm) * kLookahead_mm * kLookahead_mm;
  return start;
}

void Supervisor::stop_without_path() {
  const PathOutlook& best = route_.outlook();
  if (best.reachable)
    stop(Reason::path_blocked, best.nearest_mm, "mm from an obstacle at best");
  else if (!std::isfinite(best.slack_mm) || best.slack_mm <= kOutsideModel_mm)
    stop(Reason::outside_model, model::tilt_rad(needle_state_->pose), "rad tilt");
  else
    stop(Reason::way_point_unreachable, -best.slack_mm, "mm short");
}

// Where the law is to aim. False: latched, there is no way.
bool Supervisor::see_path(double elapsed_s) {
  pauses_for_path_ = false;
  aim_mm_ = rendezvous_.target_mm();
  if (!route_.is_needed()) return true;
  const double miss_max_mm = config_.safety.target_miss_max_mm + kTargetDeviations * rendezvous_.target_sd_mm();
  switch (route_.look(path_start(), {rendezvous_.target_mm(), miss_max_mm, true}, elapsed_s / config_.period_s)) {
    case Route::Way::clear:
      aim_mm_ = route_.aim_mm();
      return true;
    case Route::Way::searching:
      pauses_for_path_ = true;
      return true;
    case Route::Way::blocked:
      stop_without_path();
      return false;
    case Route::Way::missed:
      stop(Reason::way_point_missed, route_.missed_mm(), "mm off");
      return false;
  }
  return false;
}

bool Supervisor::see_geometry() {
  const model::Pose tip = cutting_tip();
  status_.arc = arc_geometry(tip, needle_now(), shaft_now(), aim_mm_, needle_state_->uncertain);
  if (by_arcs()) return status_.arc.in_domain;
  status_.geometry = steering_geometry(tip, needle_now(), aim_mm_, config_.limits.insertion_rate_mm_s,
                                       config_.gains.parameter_uncertainty, shaft_now());
  return status_.geometry.in_domain;
}

// What the law wants at this instant, without ramps.
Rates Supervisor::steer(std::int64_t now_utime) {
  // Below the arrival tolerance, or the law would leave all of it unused.
  const double tolerance_mm = std::min(arrival_tolerance_mm(), config_.gains.tolerance_mm);
  const double rotation_rad = actuator_->rotation_rad;
  Rates wanted;
  double ahead_mm = 0, off_rad = 0;
  if (by_arcs()) {
    wanted = arcs_.step(status_.arc, rotation_rad, actuator_->insertion_mm, tolerance_mm, config_);
    ahead_mm = status_.arc.ahead_mm;
    off_rad = status_.arc.facing_rad;
  } else {
    wanted = steering_rates(status_.geometry, rotation_rad, tolerance_mm, config_);
    ahead_mm = status_.geometry.ahead_mm;
    off_rad = status_.geometry.sigma_rad;
  }
  if (axes_.turns_late()) {
    const double share = std::min(1.0, std::abs(off_rad) / config_.gains.boundary_layer_rad);
    wanted.rotation_rad_s =
        base_rate_rad_s(wanted.rotation_rad_s, axes_.take_up_rad(wanted.rotation_rad_s), share, config_.limits);
  }
  // Come to rest at the target's closest approach: never faster than the ramp can stop within what is left.
  // At a way-point it does not, but nothing brakes where the target is nearer than that.
  if (route_.is_needed() && !route_.aims_at_target()) ahead_mm = std::max(ahead_mm, to_go_mm());
  const double left_mm = insertion_left_mm(ahead_mm);
  const double braking = std::sqrt(2 * 0.5 * config_.limits.insertion_acceleration_mm_s2 * left_mm);
  const double in_time = rendezvous_.rate_limit_mm_s(now_utime, ahead_mm + drawn_back_mm());
  wanted.insertion_mm_s = std::min({wanted.insertion_mm_s, braking, in_time});
  return wanted;
}

}  // namespace bevel::controller
