// SPDX-License-Identifier: MIT
// Where a fit goes along a valley that is bent, and where a bound is in the way of a step.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include <bevel/diagnosis/inference/likelihood.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSigma = 0.01;
const Noise kNoise = [] {
  Noise noise;
  noise.sigma = {kSigma};
  noise.frame_s = 1;
  return noise;
}();

class TwoUnknowns : public testing::HeldSystem {
 public:
  TwoUnknowns(const std::vector<double>& measured, double upper) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 1;
    add_recording(measured, data_.frame_s);
    for (const char* name : {"x", "y"})
      base_.push_back(
          {.name = name, .lower = -99, .upper = upper, .none = 0, .starts = {}, .prior = normal_prior(0, 1000)});
    nuisances_ = {{"own", 0}};
    groups_ = {{"own", "1", {0, 1}}};
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }
};

// Rosenbrock's: a valley along the parabola y = x^2, its floor falling slowly toward (1, 1).
class Valley final : public TwoUnknowns {
 public:
  Valley() : TwoUnknowns({0, 1}, 99) {}
  bool predict(const ModelSet&, std::size_t, const VectorXd& at, const VectorXd&, bool derivatives,
               Prediction& out) const override {
    constexpr double kSteep = 100;
    out.reading = VectorXd{{kSteep * (at[1] - at[0] * at[0]), at[0]}};
    if (!derivatives) return true;
    out.by_shared = MatrixXd{{-2 * kSteep * at[0], kSteep}, {1, 0}};
    out.by_local = MatrixXd::Zero(2, 1);
    return true;
  }
};

Fit fitted(const TwoUnknowns& system, const VectorXd& from, const FitRules& rules) {
  const Likelihood likelihood(system, Readings(1), kNoise);
  return fit(likelihood, Layout(system, {}), from, {VectorXd::Zero(1)},
             {.nuisance_sd = VectorXd::Zero(1), .curves = {}}, {}, rules);
}

TEST(BentValley, IsFollowedToItsEnd) {
  const Fit there = fitted(Valley(), VectorXd{{-1.2, 1}}, {.max_iterations = 200});
  ASSERT_TRUE(there.valid);
  EXPECT_NEAR(there.shared[0], 1, kSigma);
  EXPECT_NEAR(there.shared[1], 1, 2 * kSigma);
  EXPECT_LT(there.iterations, 40);  // by straight steps it takes 78
}

// Two readings, x + y and nearly the same: without the bound y = 3, x = -1.
class Plane final : public TwoUnknowns {
 public:
  Plane() : TwoUnknowns({2, 2.4}, 2) {}
  bool predict(const ModelSet&, std::size_t, const VectorXd& at, const VectorXd&, bool derivatives,
               Prediction& out) const override {
    out.reading = VectorXd{{at[0] + at[1], at[0] + 1.1 * at[1] + 0.1}};
    if (!derivatives) return true;
    out.by_shared = MatrixXd{{1, 1}, {1, 1.1}};
    out.by_local = MatrixXd::Zero(2, 1);
    return true;
  }
};

TEST(Bounds, AStepThatGoesAcrossOneEndsOnItAndTheOthersFollow) {
  const Fit there = fitted(Plane(), VectorXd{{1, 0}}, {.tolerance = 1e-9});
  ASSERT_TRUE(there.valid);
  EXPECT_EQ(there.shared[1], 2);
  // The least squares of x alone, y at its bound: the mean of 2 - 2 and 2.4 - 2.2 - 0.1.
  EXPECT_NEAR(there.shared[0], 0.05, 1e-6);
  EXPECT_EQ(there.held, std::vector<Index>{1});
  EXPECT_LE(there.iterations, 3);  // where only what crosses is cut off it takes four
}

}  // namespace
}  // namespace bevel::inference
