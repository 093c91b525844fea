// SPDX-License-Identifier: MIT
// The model of a bevelled end: its moments against the silhouette counted point by point, and the fit against profiles
// made of the model.
#include <bevel/drivers/camera/end_fit.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <bevel/drivers/camera/bevel_shape.hpp>

namespace bevel::camera {
namespace {

// Radius 1, counted across at the distance x behind the tip; a point is metal if the plane has not cut off both walls.
BevelMoments counted(double x, double length, double rho) {
  BevelMoments m;
  constexpr int steps = 20000;
  const auto add = [](Moments& to, double side) {
    to.share += 1.0 / steps, to.moment += side / steps, to.second += side * side / steps;
  };
  for (int i = 0; i < steps; ++i) {
    const double side = (i + 0.5) / steps * 2.0 - 1.0;
    const double deep = std::sqrt(1.0 - side * side);
    const auto ends_behind = [&](double depth) {  // how far behind the tip the plane cuts the wall at this depth
      return 0.5 * length * (1.0 - side * std::sin(rho) - depth * std::cos(rho));
    };
    const bool far_wall = x >= ends_behind(deep), near_wall = x >= ends_behind(-deep);
    if (far_wall || near_wall) add(m.outline, side);
    if (far_wall && !near_wall) add(m.face, side);
  }
  return m;
}

TEST(BevelShape, MomentsAreThoseOfTheSilhouette) {
  for (const double rho : {-1.5, -0.7, 0.0, 0.3, 1.2})
    for (const double x : {0.3, 2.0, 6.0, 9.9}) {
      const BevelMoments m = bevel_moments(x, 10.0, std::sin(rho));
      const BevelMoments truth = counted(x, 10.0, rho);
      EXPECT_NEAR(m.outline.share, truth.outline.share, 2e-4) << rho << " " << x;
      EXPECT_NEAR(m.outline.moment, truth.outline.moment, 2e-4) << rho << " " << x;
      EXPECT_NEAR(m.outline.second, truth.outline.second, 2e-4) << rho << " " << x;
      EXPECT_NEAR(m.face.second, truth.face.second, 2e-4) << rho << " " << x;
      EXPECT_NEAR(m.face.share, truth.face.share, 2e-4) << rho << " " << x;
      EXPECT_NEAR(m.face.moment, truth.face.moment, 2e-4) << rho << " " << x;
    }
}

TEST(BevelShape, BeyondTheTipIsNothingAndTheShaftIsWhole) {
  EXPECT_EQ(bevel_moments(-0.1, 10.0, 0.5).outline.share, 0.0);
  EXPECT_EQ(bevel_moments(10.1, 10.0, 0.5).outline.share, 1.0);
  BlurredBevel blurred;
  blurred.build(10.0, 0.5, 1.5);
  EXPECT_EQ(blurred.at(-20.0).moments.outline.share, 0.0);
  EXPECT_EQ(blurred.at(40.0).moments.outline.share, 1.0);
  EXPECT_NEAR(blurred.at(15.0).moments.outline.share, 1.0, 1e-3);
}

struct Made {
  double tip = 4.0, rho = 0.8, aside = 0.7, tilt = 0.01;
};
EndProfile profile_of(const Made& made, const EndPriors& priors, double noise, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  BlurredBevel table;
  table.build(priors.bevel_px, std::sin(made.rho), priors.blur_px);
  EndProfile profile;
  profile.first_s_px = -50.0;
  for (int i = 0; i < 85; ++i) {
    const double s = profile.first_s_px + i;
    const Moments m = table.at(made.tip - s).moments.outline;
    const double c = made.aside + made.tilt * (s - made.tip);
    profile.dark.push_back(priors.height * (m.share + noise * normal(random)));
    profile.moment.push_back(priors.height * (c * m.share + priors.radius_px * m.moment +
                                              noise * priors.window_px / std::sqrt(3.0) * normal(random)));
    const double second = priors.radius_px * priors.radius_px * m.second + 2.0 * c * priors.radius_px * m.moment +
                          (c * c + priors.blur_px * priors.blur_px) * m.share;
    const double spread = std::sqrt(5.0) * (1.5 * second / (priors.window_px * priors.window_px) - 0.5 * m.share);
    profile.spread.push_back(priors.height * (spread + noise * normal(random)));
    profile.beside.push_back(170.0);
  }
  return profile;
}

TEST(EndFit, FindsTheAxisAndTheTipAndKnowsHowWell) {
  constexpr uint64_t seed = 7;
  constexpr int trials = 200;
  std::mt19937_64 random(seed);
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  EndPriors priors;
  priors.curvature_sigma_per_px = 0.002;
  double squared_along = 0.0, squared_across = 0.0, squared_slope = 0.0, bias_along = 0.0;
  for (int i = 0; i < trials; ++i) {
    const Made made{within(-6.0, 6.0), within(-1.4, 1.4), within(-1.0, 1.0), within(-0.03, 0.03)};
    const EndFit fit = fit_end(profile_of(made, priors, 0.03, seed + static_cast<uint64_t>(i)), priors);
    ASSERT_TRUE(fit.converged) << i;
    squared_along += std::pow(fit.tip.s_px - made.tip, 2) / fit.tip.s_variance_px2 / trials;
    squared_across += std::pow(fit.tip.across_px - made.aside, 2) / fit.tip.across_variance_px2 / trials;
    squared_slope += std::pow(fit.slope - made.tilt, 2) / fit.slope_variance / trials;
    bias_along += (fit.tip.s_px - made.tip) / trials;
  }
  std::printf(
      "%d profiles, seed %llu: squared errors over variance: along %.2f, across %.2f, slope %.2f; bias %.3f px\n",
      trials, static_cast<unsigned long long>(seed), squared_along, squared_across, squared_slope, bias_along);
  for (const double squared : {squared_along, squared_across, squared_slope}) {
    EXPECT_GT(squared, 0.5);
    EXPECT_LT(squared, 1.6);
  }
  EXPECT_LT(std::abs(bias_along), 0.15);
}

// A faint second piece beyond the needle's end makes two ends likely: the variance has to hold both.
TEST(EndFit, AnotherEndThatIsNearlyAsLikelyIsDoubt) {
  EndPriors priors;
  priors.curvature_sigma_per_px = 0.002;
  const Made made{0.0, 0.0, 0.0, 0.0};
  EndProfile clear = profile_of(made, priors, 0.02, 3);
  EndProfile doubtful = clear;
  for (int i = 50; i < 72; ++i) doubtful.dark[static_cast<size_t>(i)] += 0.35 * priors.height;
  const EndFit sure = fit_end(clear, priors);
  const EndFit unsure = fit_end(doubtful, priors);
  ASSERT_TRUE(sure.converged);
  ASSERT_TRUE(unsure.converged);
  EXPECT_GT(unsure.tip.s_variance_px2, 10.0 * sure.tip.s_variance_px2);
}

TEST(EndFit, TooFewSamplesAreNoFit) { EXPECT_FALSE(fit_end({}, {}).converged); }

}  // namespace
}  // namespace bevel::camera
