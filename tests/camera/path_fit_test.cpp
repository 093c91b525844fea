// SPDX-License-Identifier: MIT
// Fits of planar paths against closed forms and made paths.
#include "tests/camera/path_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <bevel/error.hpp>

namespace bevel::test {
namespace {

std::vector<PathTip> tips_of(const PathFit& truth, double noise_mm, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<PathTip> tips;
  for (int i = 0; i < 17; ++i)
    tips.push_back(
        {18.0 + 8.0 * i, truth.aside_mm(18.0 + 8.0 * i) + noise_mm * noise(random), std::max(noise_mm, 0.01)});
  return tips;
}

PathFit path(double curvature_per_mm, double lambda1, double lambda2) {
  PathFit truth;
  truth.first_depth_mm = 18.0;
  truth.p = Eigen::VectorXd::Zero(5);
  truth.p << 20.0, 0.03, curvature_per_mm, lambda1, lambda2;
  return truth;
}

TEST(PathFit, TheBicycleDrawsACircle) {
  const PathFit bicycle = path(0.002, 0.0, 0.0);
  for (const double depth_mm : {18.0, 60.0, 146.0}) {
    const double sine = std::sin(0.03) + 0.002 * (depth_mm - 18.0);
    EXPECT_NEAR(bicycle.aside_mm(depth_mm), 20.0 + (std::cos(0.03) - std::sqrt(1.0 - sine * sine)) / 0.002, 1e-6);
  }
}

TEST(PathFit, CurvatureIsFoundWithItsStandardError) {
  double squared = 0.0;
  constexpr int insertions = 200;
  for (uint64_t seed = 1; seed <= insertions; ++seed) {
    const PathFit fit = fit_path(tips_of(path(0.0015, 0.0, 0.0), 0.1, seed), PathModel::bicycle);
    squared += std::pow((fit.p[2] - 0.0015) / fit.sd[2], 2) / insertions;
  }
  EXPECT_GT(squared, 0.7);
  EXPECT_LT(squared, 1.3);
}

// Its own path to nothing, the other's not: what is held out can tell them apart.
TEST(PathFit, TheModelThatMadeThePathForetellsIt) {
  const auto tips = tips_of(path(0.002, 0.49, 0.22), 0.02, 7);
  EXPECT_LT(rms(last_left_out(tips, PathModel::agar, 4)), 0.1);
  EXPECT_GT(rms(last_left_out(tips, PathModel::bicycle, 4)), 3.0 * rms(last_left_out(tips, PathModel::agar, 4)));
  EXPECT_LT(rms(each_left_out(tips, PathModel::agar)), 0.04);
}

TEST(PathFit, FewerTipsThanParametersAreRefused) {
  EXPECT_THROW(fit_path({{10.0, 1.0, 0.1}}, PathModel::bicycle), bevel::ArgumentError);
}

}  // namespace
}  // namespace bevel::test
