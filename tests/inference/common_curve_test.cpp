// SPDX-License-Identifier: MIT
// What all recordings share looks like recordings that differ: a curve that is common, and a smaller one that stands
// out beside what a wide spread leaves.
#include <gtest/gtest.h>

#include <random>

#include <bevel/diagnosis/inference/evidence.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// y = level + (slope_r + a line over x) + a line over w(x) + white noise; the slope may be each recording's own: every
// other one is own_slope above the common one, the rest as much below.
class CommonSlope final : public testing::HeldSystem {
 public:
  static constexpr Index kReadings = 60;
  static constexpr double kSigma = 0.2;
  static double x(Index i) { return static_cast<double>(i) / (kReadings - 1); }
  static double w(Index i) { return std::cos(6 * 3.14159265 * x(i)); }

  struct Truth {
    std::size_t recordings = 12;
    double slope = 0.6, own_slope = 0, wave = 0.06;
  };
  CommonSlope(unsigned seed, const Truth& truth) {
    data_.claimed_sd = {kSigma};
    data_.frame_s = 1;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t r = 0; r < truth.recordings; ++r) {
      const double slope = truth.slope + (r % 2 == 0 ? truth.own_slope : -truth.own_slope);
      std::vector<double> measured;
      for (Index i = 0; i < kReadings; ++i)
        measured.push_back(slope * x(i) + truth.wave * w(i) + kSigma * normal(random));
      add_recording(measured, data_.frame_s);
    }
    base_ = {{.name = "level", .lower = -9, .upper = 9, .none = 0, .starts = {}, .prior = normal_prior(0, 1)}};
    nuisances_ = {{"slope", 0}};
    groups_ = {{"slope", "1", {0, 0.3, 0.6}}};
    curves_ = {{.component = "reading", .unit = "1", .covariate = "x", .at = {0, 1}},
               {.component = "reading", .unit = "1", .covariate = "w", .at = {-1, 1}}};
  }
  bool predict(const ModelSet&, std::size_t, const VectorXd& shared, const VectorXd& local, bool derivatives,
               Prediction& out) const override {
    VectorXd along(kReadings);
    for (Index i = 0; i < kReadings; ++i) along[i] = x(i);
    out.reading = VectorXd::Constant(kReadings, shared[0]) + local[0] * along;
    if (!derivatives) return true;
    out.by_shared = MatrixXd::Ones(kReadings, 1);
    out.by_local = along;
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override {
    MatrixXd out(kReadings, 4);
    for (Index i = 0; i < kReadings; ++i) out.row(i) << 1 - x(i), x(i), 0.5 * (1 - w(i)), 0.5 * (1 + w(i));
    return out;
  }
};

Likelihood likelihood_of(const CommonSlope& system) {
  Noise noise;
  noise.sigma = {CommonSlope::kSigma};
  noise.frame_s = 1;
  return {system, Readings(system.data().recordings.size()), noise};
}

Evaluated evaluate_base(const CommonSlope& system, const Likelihood& likelihood) {
  const Layout layout(system, {});
  const std::vector<VectorXd> local(system.data().recordings.size(), layout.local_start());
  return evaluate(likelihood, layout, layout.shared_start(), local, VectorXd::Constant(1, 0.3));
}

TEST(Discrepancy, IsLookedForWhereRecordingsDoNotDifferToo) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const CommonSlope system(seed, {});
    const Likelihood likelihood = likelihood_of(system);
    Evaluated at = evaluate_base(system, likelihood);
    ASSERT_TRUE(at.valid);
    EXPECT_GT(at.fit.scales.nuisance_sd[0], 0);  // the slope passes for spread
    const Discrepancy discrepancy(likelihood, at.fit);
    add_discrepancy(likelihood, discrepancy, {.log_prior_odds = -2, .log_prior_odds_more = -5}, at);
    ASSERT_TRUE(at.fit_with_curve);
    EXPECT_EQ(system.curves()[at.curves.front().prior.curve].covariate, "w");  // beside the spread
    EXPECT_EQ(system.curves()[at.fit_with_curve->scales.curves.front().curve].covariate, "x");
    EXPECT_EQ(at.fit_with_curve->scales.nuisance_sd[0], 0);
  }
}

// Where recordings do differ, what was looked for beside no spread comes to nothing; what is not worth a fit counts by
// the linear model all the same.
TEST(Discrepancy, OfWhichNothingStandsOutCountsByTheLinearModel) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const CommonSlope system(seed, {.recordings = 6, .slope = 0.25, .own_slope = 0.2, .wave = 0});
    const Likelihood likelihood = likelihood_of(system);
    Evaluated at = evaluate_base(system, likelihood);
    ASSERT_TRUE(at.valid);
    const Discrepancy discrepancy(likelihood, at.fit);
    add_discrepancy(likelihood, discrepancy, {.log_prior_odds = -2, .log_prior_odds_more = -5}, at,
                    {.hopeless_below = at.log_evidence - 10});
    ASSERT_LT(at.curves.front().log_bayes_factor, 3);
    double mean = 0;
    for (const CurveFactor& one : at.curves)
      mean += std::exp(one.log_bayes_factor) / static_cast<double>(at.curves.size());
    EXPECT_NEAR(at.log_bayes_factor_curve, std::log(mean), 1e-9);
    EXPECT_GT(mean, 0.1);
  }
}

}  // namespace
}  // namespace bevel::inference
