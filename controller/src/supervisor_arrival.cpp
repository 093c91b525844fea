// SPDX-License-Identifier: MIT
// Which targets are accepted, the predicted miss on the way, and the outcome at the closest approach.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <bevel/controller/supervisor.hpp>

namespace bevel::controller {
namespace {

constexpr double kReportedAgain_mm = 0.5;  // growth of a predicted miss that is reported anew
// Insertion during which the prediction has to persist. An estimate that begins in the tissue finds its heading within
// some millimetres of motion, and its covariance is of a linear filter.
constexpr double kLostAfter_mm = 5;

std::string text_of(const Miss& miss) {
  char text[96];
  std::snprintf(text, sizeof text, "%.2f +- %.2f mm from the target; tolerance %.2f mm", miss.distance_mm, miss.sd_mm,
                miss.tolerance_mm);
  return text;
}

}  // namespace

// Bounds of the tip's workspace, before anything is computed from the position.
bool Supervisor::is_inside(const Eigen::Vector3d& target_mm) {
  const SafetyLimits& safety = config_.safety;
  const double depth_mm = target_mm.z(), lateral_mm = target_mm.head<2>().norm();
  if (!(depth_mm >= safety.depth_min_mm && depth_mm <= safety.depth_max_mm)) {
    stop(Reason::target_outside, depth_mm, "mm",
         {"z", safety.depth_min_mm, safety.depth_max_mm,
          "choose another target, or change controller.safety.depth_min_mm or depth_max_mm"});
    return false;
  }
  if (!(lateral_mm <= safety.lateral_max_mm)) {
    stop(Reason::target_outside, lateral_mm, "mm",
         {"distance from the z axis", 0, safety.lateral_max_mm,
          "choose another target, or raise controller.safety.lateral_max_mm"});
    return false;
  }
  return true;
}

// One position outside the workspace is ignored, as one jump is (TargetTrack); a second in a row is a latched stop.
bool Supervisor::follow_target(const Target& target, std::int64_t now_utime) {
  const SafetyLimits& safety = config_.safety;
  const Eigen::Vector3d& at_mm = target.position_mm;
  const bool is_outside = !(at_mm.z() >= safety.depth_min_mm && at_mm.z() <= safety.depth_max_mm &&
                            at_mm.head<2>().norm() <= safety.lateral_max_mm);
  if (is_outside) {
    if (was_outside_) is_inside(at_mm);
    was_outside_ = true;
    return false;
  }
  was_outside_ = false;
  rendezvous_.observe(target.utime_or(now_utime), at_mm);
  return true;
}

double Supervisor::arrival_tolerance_mm() const {
  return target_ && target_->tolerance_mm > 0 ? target_->tolerance_mm : config_.safety.arrival_tolerance_mm;
}

// In the target's plane, if the law steers on. The standard deviation takes the estimate's errors as independent.
Miss Supervisor::predicted_miss() const {
  const double target_sd_mm = rendezvous_.target_sd_mm();
  if (route_.is_needed()) return {std::max(0.0, -route_.outlook().slack_mm), target_sd_mm, arrival_tolerance_mm()};
  const double tip_sd_mm = std::sqrt(needle_state_->position_variance_mm2);
  const double heading_sd_mm = std::sqrt(needle_state_->heading_variance_rad2) * status_.arc.ahead_mm;
  const double sd_mm =
      std::hypot(std::hypot(tip_sd_mm, heading_sd_mm), std::hypot(status_.arc.reach_sd_mm, target_sd_mm));
  return {arc_miss_mm(status_.arc, by_half_turns()), sd_mm, arrival_tolerance_mm()};
}

// False: latched, the target has left the reachable set.
bool Supervisor::check_miss() {
  if (!route_.is_needed() && !(status_.arc.in_domain && status_.arc.ahead_mm > 0)) return true;  // no prediction
  status_.miss = predicted_miss();
  const Miss& miss = status_.miss;
  const SafetyLimits& safety = config_.safety;
  const double inserted_mm = actuator_->insertion_mm;
  if (!miss.exceeds(std::min(miss.tolerance_mm, safety.target_miss_max_mm))) {
    beyond_since_mm_.reset();
    if (miss.distance_mm <= miss.tolerance_mm) status_.target_lost = false;
    return true;
  }
  if (!beyond_since_mm_) beyond_since_mm_ = inserted_mm;
  if (inserted_mm - *beyond_since_mm_ < kLostAfter_mm) return true;
  const bool stops = safety.target_lost == TargetLost::stop;
  const double stop_above_mm =
      stops ? std::min(miss.tolerance_mm, safety.target_miss_max_mm) : safety.target_miss_max_mm;
  if (miss.exceeds(stop_above_mm)) {
    stop(Reason::target_unreachable, miss.distance_mm, "mm",
         {"predicted miss", 0, stop_above_mm,
          stops ? "retract and arm again, or set controller.safety.target_lost = \"warn\""
                : "retract and arm again, or raise controller.safety.target_miss_max_mm"});
    return false;
  }
  if (!status_.target_lost || miss.distance_mm > status_.lost_miss.distance_mm + kReportedAgain_mm)
    status_.lost_miss = miss;
  status_.target_lost = true;
  return true;
}

void Supervisor::hold(Reason reason) {
  clear_reason();
  status_.state = State::hold;
  status_.reason = reason;
  if (reason != Reason::retracted) return;
  status_.value = actuator_->insertion_mm;
  status_.unit = "mm inserted";
}

// The outcome, once the axes are stationary and the measurements of their last motion have arrived. A target that moves
// is taken where it was at the closest approach.
void Supervisor::settle(std::int64_t now_utime) {
  if (status_.state != State::hold || status_.reason != Reason::coming_to_rest) return;
  if (!commands_.told_to_rest(now_utime, 2 * config_.safety.axis_delay_s)) return;
  const double distance_mm = (needle_state_->pose.p_mm - met_mm_).norm();
  status_.miss = {distance_mm, std::hypot(std::sqrt(needle_state_->position_variance_mm2), met_sd_mm_),
                  arrival_tolerance_mm()};
  status_.reason = status_.miss.is_within() ? Reason::arrived : Reason::missed;
}

std::string describe(const Status& s) {
  if (s.reason == Reason::none)
    return s.target_lost ? "the target has left the reachable set: predicted " + text_of(s.lost_miss) : "";
  std::string text = to_string(s.reason);
  char number[256];
  if (s.reason == Reason::arrived || s.reason == Reason::missed) {
    text += ": " + text_of(s.miss);
  } else if (s.allowed.place[0] != '\0') {
    std::snprintf(number, sizeof number, ": %s is %.4g %s; allowed %.4g to %.4g mm%s%s", s.allowed.place, s.value,
                  s.unit, s.allowed.least, s.allowed.most, s.allowed.remedy[0] != '\0' ? ": " : "", s.allowed.remedy);
    text += number;
  } else if (s.unit[0] != '\0') {
    std::snprintf(number, sizeof number, " (%.3g %s)", s.value, s.unit);
    text += number;
  }
  return text;
}

}  // namespace bevel::controller
