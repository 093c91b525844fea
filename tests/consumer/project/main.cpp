// SPDX-License-Identifier: MIT
// Simulates an insertion of 100 mm, gives measured tip positions to the estimator and prints true and estimated tip.
#include <iostream>

#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/model/kinematics.hpp>

int main() {
  const bevel::model::NeedleParameters needle;
  const bevel::model::StepInput step{.insertion_mm = 0.1, .curvature_per_mm = {needle.curvature_per_mm, 0}};
  bevel::estimator::NeedleEstimator estimator{bevel::estimator::EstimatorConfig()};
  bevel::model::Pose tip;
  for (int i = 0; i <= 1000; ++i) {
    if (i > 0 && !bevel::model::advance(tip, step, slip_parameters(needle))) return 1;
    const std::int64_t utime = 1'000'000 + 10'000 * i;
    estimator.add(bevel::model::ActuatorState{.utime = utime, .seq = i, .insertion_mm = i * step.insertion_mm});
    estimator.add(bevel::model::TipMeasurement{
        .utime = utime, .seq = i, .position_mm = tip.p_mm, .information_per_mm2 = Eigen::Matrix3d::Identity()});
  }
  const Eigen::Vector3d estimated = estimator.estimate(1'000'000 + 10'000 * 1000).tip.p_mm;
  std::cout << "true tip " << tip.p_mm.transpose() << " mm, estimated " << estimated.transpose() << " mm\n";
  return (estimated - tip.p_mm).norm() < 1 ? 0 : 1;
}
