// SPDX-License-Identifier: MIT
// Readings of cameras that look along no axis of {A}, joined into one: what the one says of any place is what they all
// said.
#include <gtest/gtest.h>

#include <random>

#include <bevel/estimator/past.hpp>

namespace bevel::estimator {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double squares(const Vector3d& at, const Vector3d& seen, const Matrix3d& W) { return (at - seen).dot(W * (at - seen)); }

TEST(Past, JoinedRaysSayWhatEachOfThemSaid) {
  const NeedleFilter filter{EstimatorConfig{}};
  const FilterState rest = filter.initial();
  std::mt19937_64 random(8);
  std::normal_distribution<double> any;
  for (const int cameras : {1, 2}) {
    Past past(64);
    past.restart(rest);
    std::vector<PastStep> steps;
    for (int i = 0; i < 12; ++i) {
      // Nearly the same ray again and again, of one camera or of two in turn.
      const Vector3d ray =
          (Vector3d(1, 0.3, 0.2 - 0.9 * (i % cameras)) + 1e-3 * Vector3d(any(random), any(random), any(random)))
              .normalized();
      PastStep step;
      step.measured = true;
      step.information_per_mm2 = 30 * (Matrix3d::Identity() - ray * ray.transpose());
      step.position_mm = 0.2 * Vector3d(any(random), any(random), any(random)) + 25 * any(random) * ray;
      past.add(rest, step, rest, Moved{}, filter);
      steps.push_back(step);
    }
    past.close(rest, filter);
    ASSERT_EQ(past.steps().size(), 1U) << "one reading";
    const PastStep& one = past.steps().front();
    double constant = 0;
    for (int i = 0; i < 5; ++i) {
      const Vector3d at(any(random), any(random), any(random));
      double all = 0;
      for (const PastStep& step : steps) all += squares(at, step.position_mm, step.information_per_mm2);
      const double left = all - squares(at, one.position_mm, one.information_per_mm2);
      if (i == 0) constant = left;
      EXPECT_NEAR(left, constant, 1e-6 * all) << "a part that depends on the place";
    }
  }
}

}  // namespace
}  // namespace bevel::estimator
