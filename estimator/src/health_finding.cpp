// SPDX-License-Identifier: MIT
// The reason of an unhealthy estimate, with its value and its limit.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/estimator/health.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/model/age.hpp>

namespace bevel::estimator {

// The rejects of a source that fell silent do not count any more.
NeedleEstimator::Rejects NeedleEstimator::rejects_in_row(const FilterState& state, std::int64_t now_utime) const {
  const double forgotten_s = filter_.config().limits.rejects_forgotten_s;
  const auto count = [&](std::int32_t in_row, std::int64_t newest_utime) {
    return model::age_s(now_utime, newest_utime) > forgotten_s ? 0 : in_row;
  };
  Rejects rejects;
  rejects.of_all = count(state.rejects_in_row, state.reading_utime);
  rejects.of_one = count(state.heading_rejects_in_row, state.heading_utime);
  for (std::size_t camera = 0; camera < state.camera_utime.size(); ++camera)
    rejects.of_one =
        std::max(rejects.of_one, count(state.camera_rejects_in_row.at(camera), state.camera_utime.at(camera)));
  return rejects;
}

HealthFinding NeedleEstimator::finding(const Estimate& estimate, std::int64_t now_utime) const {
  const FilterState& state = estimate.state;
  const HealthLimits& limits = filter_.config().limits;
  const auto diagonal = state.covariance.diagonal();
  const auto age_s = [now_utime](std::int64_t utime) { return model::age_s(now_utime, utime); };
  if (estimate.health & kOutsideModel)
    return {kOutsideModel, "tilt outside the slip model's domain", model::tilt_rad(state.pose), 0.5 * std::numbers::pi,
            "rad"};
  if (estimate.health & kRejecting) {
    const Rejects rejects = rejects_in_row(state, now_utime);
    return {kRejecting, "measurements rejected in a row", static_cast<double>(std::max(rejects.of_all, rejects.of_one)),
            static_cast<double>(filter_.config().gate.rejects_before_unhealthy - 1), ""};
  }
  if (estimate.health & kUncertain)
    return {kUncertain, "standard deviation of the position", std::sqrt(diagonal.head<3>().maxCoeff()),
            limits.position_sd_mm, "mm"};
  if (estimate.health & kHeadingUncertain)
    return {kHeadingUncertain, "standard deviation of the heading", std::sqrt(diagonal.segment<2>(3).maxCoeff()),
            limits.heading_sd_rad, "rad"};
  if (estimate.health & kMeasurementStale)
    return {kMeasurementStale, "age of the newest measurement", age_s(state.reading_utime), limits.measurement_age_s,
            "s"};
  if (estimate.health & kNoMeasurement) return {kNoMeasurement, "no measurement accepted", 0, 0, ""};
  if (estimate.health & kActuatorStale)
    return {kActuatorStale, "age of the actuator state", age_s(estimate.utime), limits.actuator_age_s, "s"};
  return {};
}

}  // namespace bevel::estimator
