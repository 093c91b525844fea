// SPDX-License-Identifier: MIT
#pragma once
// A simulated insertion through the estimator, and how far the result is from the truth.
#include <Eigen/Cholesky>
#include <algorithm>
#include <random>
#include <vector>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/needle_estimator.hpp>
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

// Sends everything up to 0.4 s late, each message on its own; the first actuator state at once, where all begins.
inline void play_shuffled(NeedleEstimator& estimator, const Insertion& data, std::mt19937_64& rng) {
  struct Event {
    std::int64_t arrival;
    enum { actuator, measurement, heading } kind;
    std::size_t index;
  };
  std::vector<Event> events;
  std::uniform_int_distribution<std::int64_t> delay(0, 400'000);
  for (std::size_t i = 0; i < data.actuators.size(); ++i)
    events.push_back({data.actuators[i].utime + (i ? delay(rng) : 0), Event::actuator, i});
  for (std::size_t i = 0; i < data.measurements.size(); ++i)
    events.push_back({data.measurements[i].utime + 1000 + delay(rng), Event::measurement, i});
  for (std::size_t i = 0; i < data.headings.size(); ++i)
    events.push_back({data.headings[i].utime + 1000 + delay(rng), Event::heading, i});
  std::ranges::stable_sort(events, {}, &Event::arrival);
  for (const Event& e : events) {
    if (e.kind == Event::actuator) estimator.add(data.actuators[e.index]);
    if (e.kind == Event::measurement) estimator.add(data.measurements[e.index]);
    if (e.kind == Event::heading) estimator.add(data.headings[e.index]);
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
