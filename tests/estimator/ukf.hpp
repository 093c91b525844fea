// SPDX-License-Identifier: MIT
#pragma once
// An unscented Kalman filter of the same state, model and measurements as the needle filter: a second way to the same
// posterior, to compare with. In order, at full cost, for tests only.
// Source: Julier and Uhlmann 2004, Proc. IEEE 92(3); sigma points on the group as in Brossard et al. 2020, IROS.
#include <bevel/estimator/config.hpp>
#include <bevel/estimator/needle_filter.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::estimator::testing {

class Ukf {
 public:
  explicit Ukf(const EstimatorConfig& config);
  void predict(double insertion_mm, double rotation_rad);
  // Positions with a diagonal information matrix. Returns d^2 of the innovation.
  double update(const model::TipMeasurement& measurement);
  const FilterState& state() const { return state_; }

 private:
  std::array<FilterState, 19> sigma_points() const;

  EstimatorConfig config_;
  FilterState state_;
};

}  // namespace bevel::estimator::testing
