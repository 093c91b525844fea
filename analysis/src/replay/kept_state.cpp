// SPDX-License-Identifier: MIT
#include <bevel/analysis/replay/kept_state.hpp>

namespace bevel::analysis {

KeptState::KeptState(const estimator::FilterState& state)
    : pose(state.pose),
      curvature_per_mm(state.curvature_per_mm),
      lambda1_per_rad(state.lambda1_per_rad),
      lambda2(state.lambda2),
      wheelbase_mm(state.wheelbase_mm),
      bending_mm(state.bending_mm),
      measurement_utime(state.measurement_utime),
      reading_utime(state.reading_utime),
      rejects_in_row(state.rejects_in_row),
      reset_count(state.reset_count),
      outside_model(state.outside_model) {
  double* entry = covariance_.data();
  for (Eigen::Index i = 0; i < 9; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) *entry++ = state.covariance(i, j);
  for (Eigen::Index j = 0; j < 9; ++j) *entry++ = state.tenth_covariance[j];
  *entry = state.tenth_variance;
}

estimator::FilterState KeptState::unpacked() const {
  estimator::FilterState state;
  state.pose = pose;
  state.curvature_per_mm = curvature_per_mm;
  state.lambda1_per_rad = lambda1_per_rad;
  state.lambda2 = lambda2;
  state.wheelbase_mm = wheelbase_mm;
  state.bending_mm = bending_mm;
  state.measurement_utime = measurement_utime;
  state.reading_utime = reading_utime;
  state.rejects_in_row = rejects_in_row;
  state.reset_count = reset_count;
  state.outside_model = outside_model;
  const double* entry = covariance_.data();
  for (Eigen::Index i = 0; i < 9; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) state.covariance(i, j) = state.covariance(j, i) = *entry++;
  for (Eigen::Index j = 0; j < 9; ++j) state.tenth_covariance[j] = *entry++;
  state.tenth_variance = *entry;
  return state;
}

}  // namespace bevel::analysis
