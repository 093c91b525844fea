#pragma once
// A simulated insertion through the estimator, and how far the result is from the truth.
#include <Eigen/Cholesky>

#include "estimator/error_state.hpp"
#include "estimator/needle_estimator.hpp"
#include "tests/estimator/insertion.hpp"

namespace bevel::estimator::testing {

// Sends everything in order of arrival: each measurement and heading `latency_us` after its capture.
inline void play(NeedleEstimator& estimator, const Insertion& data, std::int64_t latency_us = 0) {
  std::size_t next = 0, next_heading = 0;
  for (const auto& actuator : data.actuators) {
    while (next < data.measurements.size() && data.measurements[next].utime + latency_us < actuator.utime)
      estimator.add(data.measurements[next++]);
    while (next_heading < data.headings.size() && data.headings[next_heading].utime + latency_us < actuator.utime)
      estimator.add(data.headings[next_heading++]);
    estimator.add(actuator);
  }
}

template <int kSize = 9>
Error<kSize> error_of(const FilterState& state, const model::Pose& pose, const model::NeedleParameters& truth) {
  FilterState true_state;
  true_state.pose = pose;
  true_state.curvature_per_mm = truth.curvature_per_mm;
  true_state.lambda1_per_rad = truth.lambda1_per_rad;
  true_state.lambda2 = truth.lambda2;
  true_state.wheelbase_mm = truth.wheelbase_mm;
  return difference<kSize>(state, true_state);
}

// Squared Mahalanobis distance of the truth: chi-square of kSize degrees if the filter is consistent.
template <int kSize = 9>
double nees_of(const FilterState& state, const model::Pose& pose, const model::NeedleParameters& truth) {
  const Error<kSize> error = error_of<kSize>(state, pose, truth);
  return error.dot(covariance_of<kSize>(state).ldlt().solve(error));
}

}  // namespace bevel::estimator::testing
