// SPDX-License-Identifier: MIT
#include <bevel/controller/rendezvous.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <bevel/model/age.hpp>

namespace bevel::controller {
namespace {

// Of the largest rate, what is left of it on the way: it is lower while the bevel turns (docs/steering.md, feed).
constexpr double kUsualShare = 0.82;
constexpr double kLargestShare = 0.9;  // and what it is at best: a turn that wants more will be missed
// By so much the target may be from where it turns round before the turn counts as missed: the tolerance of a target.
constexpr double kMissedBy_mm = 0.05;

std::int64_t later(std::int64_t utime, double by_s) { return utime + std::llround(1e6 * by_s); }

}  // namespace

void Rendezvous::restart(std::int64_t utime, const Eigen::Vector3d& position_mm) {
  track_.restart();
  track_.observe(utime, position_mm);
  turn_utime_.reset();
  meeting_utime_ = utime;
  target_mm_ = position_mm;
}

void Rendezvous::plan(std::int64_t now_utime, double ahead_mm, double rate_mm_s) {
  const double way_mm = std::max(ahead_mm, 0.0);
  const std::int64_t usual_utime = later(now_utime, way_mm / (kUsualShare * rate_mm_s));
  meeting_utime_ = gate_ ? plan_turn(now_utime, usual_utime, way_mm / (kLargestShare * rate_mm_s)) : usual_utime;
  target_mm_ = track_.position_mm(meeting_utime_);
}

std::int64_t Rendezvous::plan_turn(std::int64_t now_utime, std::int64_t usual_utime, double least_s) {
  // The same turn as before, wherever newer readings put it; one that cannot be met any more is met a breath later.
  const double period_s = track_.period_s();
  turn_utime_ =
      turn_utime_ ? track_.next_turn_utime(later(*turn_utime_, -0.25 * period_s)) : track_.next_turn_utime(usual_utime);
  const double radians_per_s = 2 * std::numbers::pi / period_s;
  const double slack_s = std::sqrt(2 * kMissedBy_mm / std::max(track_.breathing_mm(), kMissedBy_mm)) / radians_per_s;
  const double late_s = least_s - model::age_s(*turn_utime_, now_utime) - slack_s;
  const double early_s = model::age_s(*turn_utime_, usual_utime);
  if (late_s > 0) turn_utime_ = later(*turn_utime_, period_s * std::ceil(late_s / period_s));
  if (early_s > period_s) turn_utime_ = later(*turn_utime_, -period_s * std::floor(early_s / period_s));
  return *turn_utime_;
}

double Rendezvous::rate_limit_mm_s(std::int64_t now_utime, double ahead_mm) const {
  if (!turn_utime_) return std::numeric_limits<double>::infinity();
  const double left_s = model::age_s(*turn_utime_, now_utime);
  return left_s > 0 ? std::max(ahead_mm, 0.0) / (kUsualShare * left_s) : std::numeric_limits<double>::infinity();
}

}  // namespace bevel::controller
