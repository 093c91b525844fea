// SPDX-License-Identifier: MIT
// The fits: what they find, what they say they cannot find, and where they stop.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <bevel/diagnosis/identification/angle_rate.hpp>
#include <bevel/diagnosis/identification/candidates.hpp>
#include <bevel/diagnosis/identification/fit_statistics.hpp>
#include <bevel/error.hpp>
#include "tests/identification/simulated_insertion.hpp"

namespace bevel::diagnosis {
namespace {

model::NeedleParameters needle(double lambda1, double lambda2) {
  model::NeedleParameters n;
  n.lambda1_per_rad = lambda1;
  n.lambda2 = lambda2;
  return n;
}

std::vector<Insertion> trials(const model::NeedleParameters& truth, int count, const SimulatedInsertion& plan,
                              std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Insertion> all;
  for (int i = 0; i < count; ++i) all.push_back(simulate_insertion(truth, plan, random));
  return all;
}

FitOptions from_plastisol() {
  FitOptions options;
  options.start = needle(0.144, 0.032);
  options.start.curvature_per_mm = 0.004;
  return options;
}

void expect_within_four_errors(const FitResult& fit, const model::NeedleParameters& truth) {
  ASSERT_TRUE(fit.converged);
  for (const auto& p : fit.parameters) {
    const std::array<double, 4> values{truth.curvature_per_mm, truth.lambda1_per_rad, truth.lambda2,
                                       truth.wheelbase_mm};
    EXPECT_NEAR(p.value, values[p.parameter], 4 * p.std_error) << kParameterNames[p.parameter];
    EXPECT_FALSE(p.at_bound);
  }
}

TEST(TrajectoryFit, RecoversTheNeedleWithAnyLossAndThreads) {
  const auto truth = needle(0.49, 0.22);
  const auto data = trials(truth, 6, {}, 10);
  auto options = from_plastisol();
  options.loss = Loss::square;
  const auto square = fit_trajectory(data, options);
  expect_within_four_errors(square, truth);
  EXPECT_NEAR(square.noise_scale, 1, 0.05);
  options.threads = 2;
  EXPECT_EQ(fit_trajectory(data, options).needle, square.needle);
  options.loss = Loss::huber;
  expect_within_four_errors(fit_trajectory(data, options), truth);
}

TEST(TrajectoryFit, OutliersMoveTheSquareLossAndNotHubers) {
  const auto truth = needle(0.49, 0.22);
  SimulatedInsertion plan;
  plan.outlier_share = 0.05;
  plan.length_mm = 120;
  const auto data = trials(truth, 6, plan, 11);
  auto options = from_plastisol();
  const auto robust = fit_trajectory(data, options);
  expect_within_four_errors(robust, truth);
  EXPECT_NEAR(robust.noise_scale, 1, 0.1);
  options.loss = Loss::square;
  const auto square = fit_trajectory(data, options);
  EXPECT_GT(square.noise_scale, 3);
  EXPECT_GT(square.parameters[0].std_error, 2 * robust.parameters[0].std_error);
}

TEST(TrajectoryFit, FindsBothSlipsAndWheelsOnASpatialPath) {
  for (const auto slip : {model::SlipDirection::isotropic, model::SlipDirection::bevel_plane})
    for (const auto wheel : {model::FrontWheel::published, model::FrontWheel::nonslip}) {
      auto truth = needle(0.3, 0.1);
      truth.slip = slip;
      truth.front_wheel = wheel;
      SimulatedInsertion plan;
      plan.spatial = true;
      plan.rotation_rad = 2.5;
      const auto data = trials(truth, 3, plan, 12);
      auto options = from_plastisol();
      options.start.slip = slip;
      options.start.front_wheel = wheel;
      expect_within_four_errors(fit_from_many_starts(data, options), truth);

      // And the table of candidates puts the truth first.
      const auto table = fit_candidates(data, options);
      const auto best = std::min_element(table.begin(), table.end(), [](const auto& a, const auto& b) {
        return (a.possible ? a.bic : 1e300) < (b.possible ? b.bic : 1e300);
      });
      EXPECT_TRUE(best->fit.needle.slip == slip && best->fit.needle.front_wheel == wheel) << best->model;
    }
}

TEST(TrajectoryFit, EntryPoseIsFoundWhereItIsFree) {
  const auto truth = needle(0.2, 0.05);
  SimulatedInsertion plan;
  plan.spatial = true;
  plan.initial_roll_rad = 0.2;
  const auto data = trials(truth, 4, plan, 13);
  auto options = from_plastisol();
  options.entry_sigma(kEntryRoll) = 0.3;
  options.entry_sigma(kEntryTiltX) = options.entry_sigma(kEntryTiltY) = 0.01;
  const auto fit = fit_from_many_starts(data, options);
  expect_within_four_errors(fit, truth);
  for (const Entry& e : fit.entries) EXPECT_NEAR(e(kEntryRoll), 0.2, 0.03);
}

// Eight insertions, one of which turns, each with a heading of its own at the entry: fitted together with the needle,
// the headings drew k half a standard error down.
TEST(TrajectoryFit, OwnHeadingsDoNotBiasTheNeedle) {
  constexpr int kSets = 200;
  constexpr double kTilt_rad = 0.012;
  auto truth = needle(0.25, 0.07);
  truth.curvature_per_mm = 0.0045;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  FitOptions options;
  options.start = truth;
  options.entry_sigma(kEntryTiltX) = options.entry_sigma(kEntryTiltY) = kTilt_rad;
  options.loss = Loss::square;
  options.estimate_scale = options.correct_correlation = false;
  double sum = 0, squares = 0;
  for (int set = 0; set < kSets; ++set) {
    std::vector<Insertion> data;
    for (int i = 0; i < 8; ++i) {
      SimulatedInsertion plan{.length_mm = 70, .speed_mm_s = 10, .measurements = 60, .spatial = true};
      plan.rotation_rad = i == 7 ? std::numbers::pi : 0;
      Insertion one = simulate_insertion(truth, plan, random);
      Entry own = Entry::Zero();
      own(kEntryTiltX) = kTilt_rad * normal(random), own(kEntryTiltY) = kTilt_rad * normal(random);
      Path square, tilted;
      ASSERT_TRUE(integrate(one, truth, Entry::Zero(), false, square) && integrate(one, truth, own, false, tilted));
      for (std::size_t k = 0; k < one.observations.size(); ++k)
        one.observations[k].position_mm += tilted.position_mm[k] - square.position_mm[k];
      data.push_back(std::move(one));
    }
    const FittedParameter* k = nullptr;
    const auto fit = fit_trajectory(data, options);
    ASSERT_TRUE((k = fit.find(kNeedleCurvature)) != nullptr);
    const double z = (k->value - truth.curvature_per_mm) / k->std_error;
    sum += z, squares += z * z;
  }
  std::printf("k, %d sets, errors in standard errors: mean %.2f, rms %.2f\n", kSets, sum / kSets,
              std::sqrt(squares / kSets));
  EXPECT_LT(std::abs(sum / kSets), 0.25);
  EXPECT_NEAR(std::sqrt(squares / kSets), 1, 0.2);
}

TEST(TrajectoryFit, SaysWhichDirectionTheDataLeaveOpen) {
  const auto truth = needle(0.144, 0.032);
  SimulatedInsertion plan;
  plan.length_mm = 60;
  plan.sigma_mm = 0.3;
  plan.measurements = 60;
  const auto data = trials(truth, 1, plan, 14);
  auto options = from_plastisol();
  options.fitted[kNeedleWheelbase] = true;
  options.start = truth;
  options.correct_correlation = false;
  const auto fit = fit_trajectory(data, options);
  EXPECT_GE(fit.unfixed_directions(), 1);
  EXPECT_GT(fit.directions.back().sigma, fit.directions.front().sigma);

  // With a prior the same data decide next to nothing along that direction, and the result says whose word it is.
  options.priors = table_one_plastisol();
  const auto with_prior = fit_trajectory(data, options);
  EXPECT_GT(with_prior.find(kNeedleLambda1)->prior_share, 0.5);
  EXPECT_LT(with_prior.find(kNeedleLambda1)->std_error, 0.18);
  EXPECT_LT(with_prior.find(kNeedleCurvature)->prior_share, 1e-12);
}

TEST(TrajectoryFit, StopsAtTheBoundOfTheDomainAndSaysSo) {
  // A belief that (26) forbids, against too few data to contradict it.
  SimulatedInsertion plan;
  plan.measurements = 20;
  const auto data = trials(needle(0.02, 0.1), 1, plan, 15);
  auto options = from_plastisol();
  options.priors[kNeedleLambda1] = Prior{-0.5, 0.01};
  const auto fit = fit_from_many_starts(data, options);
  EXPECT_TRUE(fit.find(kNeedleLambda1)->at_bound);
  EXPECT_FALSE(model::find_domain_violation(fit.needle));
  EXPECT_NEAR(fit.needle.lambda1_per_rad, fit.needle.lambda2 * fit.needle.lambda2 / (2 * std::numbers::pi), 1e-5);
}

TEST(TrajectoryFit, RefusesWhatItCannotFit) {
  const auto data = trials(needle(0.144, 0.032), 1, {}, 16);
  EXPECT_THROW(fit_trajectory({}, from_plastisol()), bevel::ArgumentError);
  auto options = from_plastisol();
  options.start.lambda1_per_rad = 0;  // (26)
  EXPECT_THROW(fit_trajectory(data, options), bevel::ArgumentError);
  options = from_plastisol();
  options.fitted = {};
  EXPECT_THROW(fit_trajectory(data, options), bevel::ArgumentError);
  options = from_plastisol();
  options.priors[kNeedleCurvature] = Prior{0.005, 0};
  EXPECT_THROW(fit_trajectory(data, options), bevel::ArgumentError);
}

TEST(TrajectoryFit, BicycleIsTheExtendedModelWithoutLambda) {
  const auto truth = needle(0, 0);
  const auto data = trials(truth, 3, {}, 17);
  const auto fit = fit_trajectory(data, bicycle_options(from_plastisol()));
  ASSERT_EQ(fit.parameters.size(), 1U);
  expect_within_four_errors(fit, truth);
}

TEST(AngleRate, RecoversLambdaFromCleanPathsAndLosesItInNoise) {
  const auto truth = needle(0.144, 0.032);
  SimulatedInsertion plan;
  plan.sigma_mm = 1e-6;
  auto start = truth;
  start.lambda1_per_rad = 0.3;
  start.lambda2 = 0.1;
  const auto clean = fit_angle_rate(trials(truth, 3, plan, 18), start);
  EXPECT_TRUE(clean.converged);
  // Cubic polynomials are not the path: even without noise lambda is off.
  EXPECT_NEAR(clean.needle.lambda2, truth.lambda2, 0.03);
  EXPECT_NEAR(clean.needle.lambda1_per_rad, truth.lambda1_per_rad, 0.08);

  plan.sigma_mm = 0.3;
  const auto noisy = trials(truth, 3, plan, 19);
  FitOptions options = from_plastisol();
  options.start.curvature_per_mm = truth.curvature_per_mm;
  options.fitted[kNeedleCurvature] = false;  // the same unknowns for both methods
  const auto rate = fit_angle_rate(noisy, start);
  const auto trajectory = fit_trajectory(noisy, options);
  EXPECT_LT(error_figures(noisy, trajectory.needle, Compare::same_insertion).rms_mm,
            error_figures(noisy, rate.needle, Compare::same_insertion).rms_mm);
}

TEST(AngleRate, RefusesATurningShaft) {
  SimulatedInsertion plan;
  plan.rotation_rad = 1;
  EXPECT_THROW(fit_angle_rate(trials(needle(0.144, 0.032), 1, plan, 20), needle(0.144, 0.032)), bevel::ArgumentError);
}

TEST(FitStatistics, ScaleAndCorrelationOfKnownNoise) {
  std::mt19937_64 random(21);
  std::normal_distribution<double> gauss;
  std::vector<double> white(20000), red(20000);
  double state = 0;
  for (std::size_t i = 0; i < white.size(); ++i) {
    white[i] = gauss(random);
    state = 0.6 * state + 0.8 * gauss(random);
    red[i] = state;
  }
  EXPECT_NEAR(lag1_correlation(red, {0, red.size()}), 0.6, 0.02);
  EXPECT_NEAR(lag1_correlation(white, {0, white.size()}), 0, 0.03);
  EXPECT_NEAR(huber_efficiency(white, 2.0), 0.99, 0.03);
  EXPECT_NEAR(robust_scale(white), 1, 0.02);
}

TEST(Figures, DepthAndInsertionAreDifferentMeasures) {
  // The bicycle best at depth 130 mm against the extended path of agar: largest error by either measure.
  SimulatedInsertion plan;
  plan.sigma_mm = 1e-9;
  plan.length_mm = 130;
  const auto data = trials(needle(0.49, 0.22), 1, plan, 22);
  const auto fit = fit_trajectory(data, bicycle_options(from_plastisol()));
  const auto along = error_figures(data, fit.needle, Compare::same_insertion);
  const auto across = error_figures(data, fit.needle, Compare::same_depth);
  EXPECT_GT(std::abs(along.largest_mm - across.largest_mm), 0.05);
  EXPECT_NEAR(error_figures(data, needle(0.49, 0.22), Compare::same_depth).largest_mm, 0, 1e-4);
}

}  // namespace
}  // namespace bevel::diagnosis
