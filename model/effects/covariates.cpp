#include "model/effects/covariates.hpp"

#include <cmath>

namespace bevel::model {
namespace {
constexpr double kMoving_mm_s = 0.05;
constexpr double kTurning_rad_s = 0.02;
}  // namespace

CovariateTracker::CovariateTracker(const BaseMotion& entry) : stopped_s_(entry.time_s), turned_mm_(entry.insertion_mm) {
  advance(entry, entry);
}

void CovariateTracker::advance(const BaseMotion& from, const BaseMotion& to) {
  const double dt_s = to.time_s - from.time_s;
  const double speed_mm_s = dt_s > 0 ? std::abs(to.insertion_mm - from.insertion_mm) / dt_s : 0;
  const double turn_rate_rad_s = dt_s > 0 ? std::abs(to.rotation_rad - from.rotation_rad) / dt_s : 0;
  if (speed_mm_s > kMoving_mm_s) stopped_s_ = to.time_s;
  if (turn_rate_rad_s > kTurning_rad_s) turned_mm_ = to.insertion_mm;
  value_ = {to.time_s,       to.insertion_mm,        speed_mm_s,
            turn_rate_rad_s, to.time_s - stopped_s_, to.insertion_mm - turned_mm_,
            to.rotation_rad};
}

}  // namespace bevel::model
