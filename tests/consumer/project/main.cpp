// SPDX-License-Identifier: MIT
// Simulates an insertion of 100 mm, gives measured tip positions to the estimator and prints true and estimated tip.
#include <iostream>

#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/model/kinematics.hpp>

int main() {
  const bevel::model::NeedleParameters needle;
  bevel::estimator::NeedleEstimator estimator(bevel::estimator::EstimatorConfig{});
  bevel::model::Pose tip;
  bevel::model::ActuatorState axes;
  for (axes.utime = 1'000'000; axes.insertion_mm <= 100; axes.utime += 10'000, axes.insertion_mm += 0.1, ++axes.seq) {
    bevel::model::TipMeasurement measurement{.utime = axes.utime, .seq = axes.seq, .position_mm = tip.p_mm};
    measurement.information_per_mm2.setIdentity();
    estimator.add(axes);
    estimator.add(measurement);
    bevel::model::advance(tip, {.insertion_mm = 0.1}, slip_parameters(needle));
  }
  const auto estimate = estimator.estimate(axes.utime);
  std::cout << "true tip " << tip.p_mm.transpose() << " mm, estimated " << estimate.tip.p_mm.transpose() << " mm\n";
  return (estimate.tip.p_mm - tip.p_mm).norm() < 1 ? 0 : 1;
}
