// SPDX-License-Identifier: MIT
// A model file that says what it does not know: the filter starts as wide as insertions differ and widens by the errors
// of a curve. Consistency on simulated insertions that differ so, and the lack of it where the filter is not told.
#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>

#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/open_loop.hpp>
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using model::DiscrepancyCurve;
using Component = model::DiscrepancyComponent;

constexpr int kRuns = 200;

// The needle itself is well known; what insertions have of their own is not.
EstimatorConfig known_needle() {
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.prior.curvature_sd_per_mm = 1e-4;
  config.prior.lambda1_sd_per_rad = 0.02;
  config.prior.lambda2_sd = 0.01;
  config.prior.position_sd_mm = 0.05;
  config.prior.tilt_sd_rad = 2e-3;
  config.prior.roll_sd_rad = 0.01;
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};
  return config;
}

struct Band {
  double lowest, highest;
};
Band band(double degrees) {
  const boost::math::chi_squared chi2(degrees);
  return {boost::math::quantile(chi2, 0.025) / degrees, boost::math::quantile(chi2, 0.975) / degrees};
}

TEST(UncertainModel, TheFilterIsConsistentWhereInsertionsDifferAsTheFileSays) {
  EstimatorConfig told = known_needle();
  told.prior.variation = {.curvature_relative = 0.12, .entry_angle_rad = 0.015, .entry_point_mm = 0.3, .roll_rad = 0.1};
  const EstimatorConfig not_told = known_needle();
  std::mt19937_64 rng(17);
  double nees = 0, untold = 0;
  for (int run = 0; run < kRuns; ++run) {
    testing::InsertionPlan plan;
    plan.cameras = 1 + run % 2;
    plan.lost_share = 0.1;
    const model::OwnValues own = model::draw(told.prior.variation, 500 + static_cast<std::uint64_t>(run));
    model::NeedleParameters needle = testing::draw_needle(told.prior, rng);
    needle.curvature_per_mm += own.curvature_relative * told.prior.needle.curvature_per_mm;
    const model::Pose start = model::of_insertion(testing::draw_start(told.prior, rng), own);
    const auto data = testing::insert(needle, start, plan, rng);
    ASSERT_TRUE(data.in_domain);
    NeedleEstimator estimator(told), narrow(not_told);
    play(estimator, data);
    play(narrow, data);
    const auto now = data.actuators.back().utime;
    nees += testing::nees_of(estimator.estimate(now).state, data.final_pose, needle) / (9.0 * kRuns);
    untold += testing::nees_of(narrow.estimate(now).state, data.final_pose, needle) / (9.0 * kRuns);
  }
  const Band expected = band(9.0 * kRuns);
  std::cout << "NEES/9 " << nees << ", band [" << expected.lowest << ", " << expected.highest << "]; " << untold
            << " where the filter is not told\n";
  EXPECT_GT(nees, expected.lowest);
  EXPECT_LT(nees, expected.highest);
  EXPECT_GT(untold, 1.5);
}

TEST(UncertainModel, StartsAsWideAsBothTogether) {
  EstimatorConfig config = known_needle();
  config.prior.variation = {.curvature_relative = 0.1, .entry_angle_rad = 0.02, .entry_point_mm = 0.4, .roll_rad = 0.2};
  const FilterState state = NeedleFilter(config).initial();
  const Prior& p = config.prior;
  const Eigen::Matrix<double, 9, 1> sd = state.covariance.diagonal().cwiseSqrt();
  EXPECT_NEAR(sd[0], std::hypot(p.position_sd_mm, 0.4), 1e-12);
  EXPECT_NEAR(sd[1], std::hypot(p.position_sd_mm, 0.4), 1e-12);
  EXPECT_NEAR(sd[2], p.position_sd_mm, 1e-12);
  EXPECT_NEAR(sd[3], std::hypot(p.tilt_sd_rad, 0.02), 1e-12);
  EXPECT_NEAR(sd[4], std::hypot(p.tilt_sd_rad, 0.02), 1e-12);
  EXPECT_NEAR(sd[5], std::hypot(p.roll_sd_rad, 0.2), 1e-12);
  EXPECT_NEAR(sd[6], std::hypot(p.curvature_sd_per_mm, 0.1 * p.needle.curvature_per_mm), 1e-12);
  EXPECT_NEAR(sd[7], p.lambda1_sd_per_rad, 1e-12);
}

// 100 mm in 10 s with turns, and the pose at its end.
testing::Insertion simulate(const model::NeedleParameters& needle, const std::vector<model::ActiveEffect>& effects,
                            std::mt19937_64& rng) {
  constexpr double kSigma_mm = 0.15;
  const model::AugmentedNeedle truth(needle, effects);
  model::AugmentedState state = truth.entry({});
  testing::Insertion data;
  double rotation_rad = 0;
  std::int64_t seq = 0;
  for (int ms = 0; ms <= 10'000; ++ms) {
    if (ms > 0) {
      rotation_rad += (ms / 2000) % 2 ? -6e-4 : 6e-4;
      EXPECT_TRUE(truth.advance(state, {1e-3 * ms, 1e-2 * ms, rotation_rad}));
    }
    const std::int64_t utime = testing::kStart_utime + std::int64_t{1000} * ms;
    if (ms % 10 == 0) {
      model::ActuatorState a;
      a.utime = utime;
      a.insertion_mm = 1e-2 * ms;
      a.rotation_rad = rotation_rad;
      data.actuators.push_back(a);
      data.final_pose = state.pose;
    }
    if (ms % 33 == 7) {
      model::TipReading seen;
      truth.point(state, seen);
      data.measurements.push_back(testing::measure(seen.position_mm, utime, seq++, 0, {1, 1, 1}, kSigma_mm, rng));
    }
  }
  return data;
}

DiscrepancyCurve curve_over(Component component, model::Covariate covariate, double last, double value, double error) {
  DiscrepancyCurve curve{component, covariate, {}, {}, {}};
  for (int i = 0; i < 8; ++i) {
    curve.at.push_back(last * i / 7);
    curve.values.push_back(value * std::sin(0.9 * i));
    curve.std_errors.push_back(error);
  }
  return curve;
}

// The true curve is drawn about the file's by its standard errors. The walk that stands for them is not their shape, so
// the band is not that of chance: not sure of itself, and not lost either.
TEST(UncertainModel, TheFilterWidensByTheErrorsOfACurve) {
  struct Case {
    DiscrepancyCurve curve;
    bool of_reading;
  };
  const std::vector<Case> cases = {
      {curve_over(Component::curvature_bevel, model::Covariate::depth_mm, 100, 5e-4, 4e-4), false},
      {curve_over(Component::curvature_across, model::Covariate::time_s, 10, 5e-4, 4e-4), false},
      {curve_over(Component::curvature_bevel, model::Covariate::speed_mm_s, 20, 5e-4, 4e-4), false},
      {curve_over(Component::advance, model::Covariate::depth_mm, 100, 0.03, 0.03), false},
      {curve_over(Component::turning, model::Covariate::depth_mm, 100, 0.005, 0.01), false},
      {curve_over(Component::x, model::Covariate::depth_mm, 100, 0.3, 0.3), true},
      {curve_over(Component::z, model::Covariate::since_speed_change_s, 1.2, 0.05, 0.05), true}};
  for (const Case& one : cases) {
    EstimatorConfig told = known_needle();
    told.effects = {model::active_discrepancy(one.curve)};
    DiscrepancyCurve certain = one.curve;
    certain.std_errors.assign(certain.at.size(), 0.0);
    EstimatorConfig not_told = known_needle();
    not_told.effects = {model::active_discrepancy(certain)};
    std::mt19937_64 rng(23);
    std::normal_distribution<double> normal;
    double nees = 0, untold = 0;
    for (int run = 0; run < kRuns; ++run) {
      const auto needle = testing::draw_needle(told.prior, rng);
      DiscrepancyCurve truth = certain;
      for (std::size_t i = 0; i < truth.at.size(); ++i) truth.values[i] += one.curve.std_errors[i] * normal(rng);
      const auto data = simulate(needle, {model::active_discrepancy(truth)}, rng);
      const auto now = data.actuators.back().utime;
      for (const bool knows : {true, false}) {
        NeedleEstimator estimator(knows ? told : not_told);
        play(estimator, data);
        const FilterState state = estimator.estimate(now).state;
        const Error<9> error = testing::error_of(state, data.final_pose, needle);
        const Eigen::Matrix<double, 6, 1> pose = error.head<6>();
        (knows ? nees : untold) += pose.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(pose)) / (6.0 * kRuns);
      }
    }
    std::cout << model::info_of(one.curve.component).name << " over " << model::name_of(one.curve.covariate)
              << ": NEES/6 of the pose " << nees << ", " << untold << " where the errors are taken for zero\n";
    EXPECT_GT(nees, 0.3);
    EXPECT_LT(nees, 1.5);
    EXPECT_GT(untold, 1.5 * nees);
  }
}

// Told of nothing, the filter is what it was, bit for bit.
TEST(UncertainModel, ACertainCurveAddsNothing) {
  const model::AugmentedNeedle needle(
      known_needle().prior.needle,
      {model::active_discrepancy(
          {Component::curvature_bevel, model::Covariate::depth_mm, {0, 50}, {0, 1e-3}, {0, 0}})});
  model::AugmentedState state = needle.entry({});
  model::Spread spread{};
  ASSERT_TRUE(needle.advance(state, {1, 10, 1}, &spread));
  EXPECT_EQ(spread, model::Spread{});
}

}  // namespace
}  // namespace bevel::estimator
