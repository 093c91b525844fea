// SPDX-License-Identifier: MIT
// The derivatives that the filter takes, beside those that are checked by perturbation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>

#include <bevel/model/kinematics.hpp>
#include "tests/estimator/play.hpp"

namespace bevel::model {
namespace {

struct Off {
  double derivatives = 0;  // as a share of what the step itself does
  double pose = 0;
};

// Largest differences over 200 random poses, needles and steps, the steps of one length.
Off largest_difference(double length_mm, double angle_rad) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  Off off;
  for (int trial = 0; trial < 200; ++trial) {
    Pose pose = exp_se3((Vector6d() << 0, 0, 0, 0.4 * unit(rng), 0.4 * unit(rng), 3 * unit(rng)).finished());
    const SlipParameters slip{0.4 + 0.3 * unit(rng), 0.2 * unit(rng), 20};
    const StepInput input{length_mm * (trial % 2 ? 1 : -1), angle_rad * unit(rng), {0.005 * unit(rng), 0}};
    Pose again = pose;
    NeedleJacobian exact, midpoint;
    EXPECT_TRUE(advance(pose, input, slip, exact));
    EXPECT_TRUE(advance_by_midpoint(again, input, slip, midpoint));
    off.pose = std::max({off.pose, (pose.p_mm - again.p_mm).norm(), (pose.R - again.R).norm()});
    const double change = (exact.pose - Matrix6d::Identity()).norm();
    off.derivatives = std::max({off.derivatives, (exact.pose - midpoint.pose).norm() / change,
                                (exact.needle - midpoint.needle).norm() / exact.needle.norm()});
  }
  return off;
}

TEST(MidpointDerivatives, AreOfSecondOrderAlongTheSamePath) {
  const Off whole = largest_difference(1.0, 0.1), half = largest_difference(0.5, 0.05);
  std::cout << "off by " << whole.derivatives << " of the step's own at 1 mm and 0.1 rad, " << half.derivatives
            << " at half of it\n";
  EXPECT_LT(whole.pose, 1e-13);
  EXPECT_LT(whole.derivatives, 3e-3);
  EXPECT_GT(whole.derivatives, 1e-6);
  EXPECT_LT(half.derivatives, 0.3 * whole.derivatives);  // a quarter, and room
}

}  // namespace
}  // namespace bevel::model

namespace bevel::estimator {
namespace {

TEST(MidpointDerivatives, LeaveAnInsertionsEstimateAsItIs) {
  std::mt19937_64 rng(6);
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  testing::InsertionPlan plan;
  plan.rotation_rate_rad_s = 3;  // 0.03 rad a step
  const auto [truth, data, again] = testing::draw_insertion(config.prior, plan, rng);
  const auto end = [&, &insertion = data](bool midpoint) {
    config.midpoint_derivatives = midpoint;
    NeedleEstimator estimator(config);
    testing::play(estimator, insertion, 50'000);
    return estimator.estimate(insertion.actuators.back().utime).state;
  };
  const FilterState exact = end(false), midpoint = end(true);
  const Error<9> off = difference<9>(exact, midpoint);
  const double in_deviations = std::sqrt(off.dot(exact.covariance.ldlt().solve(off)));
  const double of_deviations =
      (midpoint.covariance.diagonal().cwiseQuotient(exact.covariance.diagonal()).cwiseSqrt().array() - 1)
          .abs()
          .maxCoeff();
  std::cout << "off by " << in_deviations << " standard deviations, these by a share of " << of_deviations << "\n";
  EXPECT_GT(in_deviations, 0);
  EXPECT_LT(in_deviations, 0.01);
  EXPECT_LT(of_deviations, 1e-3);
}

}  // namespace
}  // namespace bevel::estimator
