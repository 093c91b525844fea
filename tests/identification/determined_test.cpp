// SPDX-License-Identifier: MIT
// Parameters that recordings do not determine stay at their value beforehand; the candidates and their selection.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/diagnosis/identification/candidates.hpp>
#include "tests/identification/simulated_insertion.hpp"

namespace bevel::diagnosis {
namespace {

constexpr double kCurvature_per_mm = 0.0125;
// As large as the residuals of real insertions with nominal entries (../shared/real/ultrasteer: 2 mm).
constexpr double kMisfit_mm = -2;

model::NeedleParameters needle(double lambda1, double lambda2) {
  model::NeedleParameters n;
  n.curvature_per_mm = kCurvature_per_mm;
  n.lambda1_per_rad = lambda1;
  n.lambda2 = lambda2;
  return n;
}

// Insertions of 80 mm whose path leaves the model's by \p misfit_mm at the end: lateral, with the third power of the
// length.
std::vector<Insertion> trials(const model::NeedleParameters& truth, double rotation_rad, double misfit_mm) {
  std::mt19937_64 random(31);
  std::vector<Insertion> all;
  for (int i = 0; i < 3; ++i) {
    SimulatedInsertion plan{.length_mm = 80, .speed_mm_s = 1, .measurements = 200, .sigma_mm = 0.1, .spatial = true};
    plan.rotation_rad = rotation_rad;
    Insertion one = simulate_insertion(truth, plan, random);
    for (Observation& o : one.observations) o.position_mm.y() += misfit_mm * std::pow(o.insertion_mm / 80, 3);
    all.push_back(std::move(one));
  }
  return all;
}

FitOptions options_from(const model::NeedleParameters& start) {
  FitOptions options;
  options.start = start;
  options.start.curvature_per_mm = 0.009;
  return options;
}

bool is_held(const FitResult& fit, Parameter parameter) {
  return std::ranges::find(fit.held, parameter, &HeldParameter::parameter) != fit.held.end();
}

TEST(Determined, SlipThatNoRotationSeparatesFromAMisfitIsHeld) {
  const auto data = trials(needle(0, 0), 0, kMisfit_mm);
  const FitOptions options = options_from(needle(0.49, 0.22));
  const FitResult free = fit_from_many_starts(data, options);
  EXPECT_GT(std::abs(free.needle.curvature_per_mm / kCurvature_per_mm - 1), 0.25) << "slip absorbs this misfit";
  const FitResult fit = fit_determined(data, options);
  ASSERT_EQ(fit.held.size(), 2U);
  EXPECT_TRUE(is_held(fit, kNeedleLambda1) && is_held(fit, kNeedleLambda2));
  EXPECT_EQ(fit.needle.lambda1_per_rad, 0.49);
  EXPECT_EQ(fit.needle.lambda2, 0.22);
  EXPECT_EQ(fit.find(kNeedleLambda1), nullptr) << "a held parameter has no standard error";
  ASSERT_NE(fit.find(kNeedleCurvature), nullptr);

  const auto all = fit_candidates(data, options);
  const Candidate& best = all[preferred(all)];
  EXPECT_NEAR(best.fit.needle.curvature_per_mm, kCurvature_per_mm, 0.1 * kCurvature_per_mm) << best.model;
}

TEST(Determined, HeldSlipIsThePriorsMeanWhereThereIsAPrior) {
  FitOptions options = options_from(needle(0.3, 0.1));
  options.priors = table_one_plastisol();
  const FitResult fit = fit_determined(trials(needle(0.144, 0.032), 0, 0), options);
  ASSERT_EQ(fit.held.size(), 2U);
  EXPECT_TRUE(fit.held[0].by_prior);
  EXPECT_EQ(fit.needle.lambda1_per_rad, 0.144);
  EXPECT_NEAR(fit.needle.curvature_per_mm, kCurvature_per_mm, 0.02 * kCurvature_per_mm);
}

TEST(Determined, SlipOfARotatedShaftIsFitted) {
  const FitResult fit = fit_determined(trials(needle(0.3, 0.1), std::numbers::pi, 0), options_from(needle(0.49, 0.22)));
  EXPECT_TRUE(fit.held.empty());
  ASSERT_NE(fit.find(kNeedleLambda1), nullptr);
  EXPECT_NEAR(fit.needle.lambda1_per_rad, 0.3, 4 * fit.find(kNeedleLambda1)->std_error);
  EXPECT_NEAR(fit.needle.curvature_per_mm, kCurvature_per_mm, 4 * fit.find(kNeedleCurvature)->std_error);
}

TEST(Determined, AWheelbaseWithLessInformationThanItsRangeIsHeld) {
  std::mt19937_64 random(32);
  SimulatedInsertion plan{.length_mm = 40, .speed_mm_s = 5, .measurements = 60, .sigma_mm = 0.3, .spatial = true};
  plan.rotation_rad = 1;
  const std::vector<Insertion> data{simulate_insertion(needle(0.144, 0.032), plan, random)};
  FitOptions options = options_from(needle(0.144, 0.032));
  options.fitted[kNeedleWheelbase] = true;
  options.correct_correlation = false;
  const FitResult fit = fit_determined(data, options);
  EXPECT_TRUE(is_held(fit, kNeedleWheelbase));
  EXPECT_EQ(fit.needle.wheelbase_mm, options.start.wheelbase_mm);
  for (const FittedParameter& p : fit.parameters)
    if (p.parameter != kNeedleCurvature) {
      EXPECT_LE(p.data_std_error, p.parameter == kNeedleLambda1 ? 0.2 : 0.1);
    }
}

TEST(Determined, RotationAtRestBetweenTwoPartsOfAnInsertionCounts) {
  Insertion one;
  one.legs = {{0, 0.5}, {10, 0}, {0, 1.2}, {10, 0}, {0, 3}};
  EXPECT_NEAR(roll_range_rad(one), 1.2, 1e-12) << "neither the roll before the first nor that after the last part";
  one.legs = {{0, 0.5}, {10, 0}, {-5, 0}};
  EXPECT_EQ(roll_range_rad(one), 0);
}

TEST(Candidates, TiltedEntriesArePreferredWhereTheDataShowThem) {
  auto data = trials(needle(0, 0), 0, 0);
  const FitOptions options = options_from(needle(0, 0));
  auto all = fit_candidates(data, options);
  ASSERT_EQ(all.size(), 4U);
  EXPECT_LT(preferred(all), 2U) << "no entry is tilted";
  const std::array<double, 3> tilt_rad{0.06, -0.05, 0.08};
  for (std::size_t i = 0; i < data.size(); ++i)
    for (Observation& o : data[i].observations) o.position_mm = model::exp_so3({tilt_rad[i], 0, 0}) * o.position_mm;
  all = fit_candidates(data, options);
  ASSERT_EQ(preferred(all), 2U) << all[preferred(all)].model;
  EXPECT_NEAR(all[2].fit.needle.curvature_per_mm, kCurvature_per_mm, 0.05 * kCurvature_per_mm);
  EXPECT_NEAR(all[2].fit.entries[2](kEntryTiltX), 0.08, 0.01);
}

TEST(Candidates, RecordingsInOnePlaneLeaveTheStructureOfTheModelFile) {
  auto start = needle(0.3, 0.1);
  start.slip = model::SlipDirection::bevel_plane;
  start.front_wheel = model::FrontWheel::nonslip;
  const auto all = fit_candidates(trials(start, 0, 0), options_from(start));
  for (const Candidate& c : all) {
    EXPECT_EQ(c.fit.needle.slip, start.slip);
    EXPECT_EQ(c.fit.needle.front_wheel, start.front_wheel);
  }
}

}  // namespace
}  // namespace bevel::diagnosis
