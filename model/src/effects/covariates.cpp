// SPDX-License-Identifier: MIT
#include <bevel/model/effects/covariates.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::model {
namespace {
constexpr double kMoving_mm_s = 0.05;
constexpr double kTurning_rad_s = 0.02;
constexpr double kChange_mm_s = 0.5;
}  // namespace

void CovariateTracker::advance(const BaseMotion& from, const BaseMotion& to) {
  const double dt_s = to.time_s - from.time_s;
  const double speed_mm_s = dt_s > 0 ? std::abs(to.insertion_mm - from.insertion_mm) / dt_s : 0;
  const double turn_rate_rad_s = dt_s > 0 ? std::abs(to.rotation_rad - from.rotation_rad) / dt_s : 0;
  if (speed_mm_s > kMoving_mm_s) history_.moved_s = to.time_s;
  if (turn_rate_rad_s > kTurning_rad_s) history_.turned_mm = to.insertion_mm;
  history_.deepest_mm = std::max(history_.deepest_mm, to.insertion_mm);
  const double velocity_mm_s = dt_s > 0 ? (to.insertion_mm - from.insertion_mm) / dt_s : history_.speed_mm_s;
  if (std::abs(velocity_mm_s - history_.speed_mm_s) > kChange_mm_s) {
    history_.changed_s = from.time_s;
    history_.speed_mm_s = velocity_mm_s;
  }
  // In the order of Covariate.
  now_.value = {to.time_s,
                to.insertion_mm,
                speed_mm_s,
                turn_rate_rad_s,
                to.time_s - history_.moved_s,
                to.insertion_mm - history_.turned_mm,
                to.rotation_rad,
                to.rotation_rad - entry_turned_rad_,
                history_.deepest_mm - to.insertion_mm};
  for (const Covariate covariate : all_covariates())
    if (tip_direction(covariate)) now_[covariate] = std::numeric_limits<double>::quiet_NaN();
  now_[Covariate::since_speed_change_s] = to.time_s - history_.changed_s;
}

double place_along(const Eigen::Vector2d& direction, const Eigen::Vector3d& point_mm) {
  double sum = 0;
  for (int i = 0; i < 2; ++i)
    if (direction[i] != 0) sum += direction[i] * point_mm[i];  // 0 times what is no number is none
  return sum;
}

std::vector<Covariates> find_covariates(std::span<const BaseMotion> nodes) {
  CovariateTracker tracker(nodes.front());
  std::vector<Covariates> all{tracker.now()};
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    tracker.advance(nodes[i - 1], nodes[i]);
    all.push_back(tracker.now());
  }
  return all;
}

}  // namespace bevel::model
