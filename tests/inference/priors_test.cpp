// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include <bevel/diagnosis/inference/priors.hpp>

namespace bevel::inference {
namespace {

double mass(const Prior& prior, double from, double to, double known_to) {
  constexpr int kSteps = 400000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    sum += std::exp(log_density(prior, from + (to - from) * (i + 0.5) / kSteps, known_to)) * (to - from) / kSteps;
  return sum;
}

TEST(Priors, HaveMassOne) {
  EXPECT_NEAR(mass(normal_prior(2, 0.5), -4, 8, 0), 1, 1e-6);
  EXPECT_NEAR(mass(flat_prior(-1, 3), -1, 3, 0), 1, 1e-6);
  EXPECT_NEAR(mass(flat_prior(-1, 3, -20, 30), -20, 30, 0), 1, 1e-4);
  // Both sides, one side, and one that its causes bound from above. Student's tails reach far.
  EXPECT_NEAR(mass(size_prior(0, 1, -1000, 1000), -1000, 1000, 1e-4), 1, 0.01);
  EXPECT_NEAR(mass(size_prior(0, 1, 0, 1000), 0, 1000, 1e-4), 1, 0.01);
  Prior below = size_prior(1, 0.1, -100, 2);
  below.largest = 1;
  EXPECT_NEAR(mass(below, -100, 1, 1e-5), 1, 0.01);
}

TEST(Priors, ASizeKnownToBeNothingIsNoEffect) {
  const Prior prior = size_prior(0, 1, -10, 10);
  // What is known to be smaller than a thirtieth has half of the density that a reported size has there.
  EXPECT_LT(log_density(prior, 1e-4, 1e-3), log_density(prior, 0.05, 1e-3));
  EXPECT_NEAR(log_density(prior, 1e-4, 1e-3), std::log(0.5 * 0.375), 0.01);
  // What is hardly known is of any size.
  EXPECT_GT(log_density(prior, 1e-4, 0.1), log_density(prior, 1e-4, 1e-3));
}

TEST(Priors, BeyondWhatTheCausesBringIsOneInTwenty) {
  Prior prior = size_prior(0, 1.5, -7, 7);
  const double inside = log_density(prior, 0.1, 1e-3);
  prior.least_distance = 0.12;
  EXPECT_NEAR(log_density(prior, 0.1, 1e-3), inside + std::log(0.05), 1e-12);
}

TEST(Priors, TheRatioMakesUpForTheStandIn) {
  const Prior prior = size_prior(0, 2, -10, 10);
  const double value = 0.7;
  const double stand_in = -0.5 * value * value * precision_of(prior) + 0.5 * std::log(precision_of(prior) / (2 * M_PI));
  EXPECT_NEAR(log_density_ratio(prior, value, 0.01) + stand_in, log_density(prior, value, 0.01), 1e-12);
  // A flat one: the volume of its normal is the range.
  const Prior flat = flat_prior(0, 120);
  EXPECT_NEAR(std::sqrt(2 * M_PI / precision_of(flat)), 120, 1e-9);
  EXPECT_NEAR(log_density_ratio(flat, 33, 1), 0, 1e-12);
  EXPECT_EQ(centre_of(flat, 33), 33);
}

}  // namespace
}  // namespace bevel::inference
