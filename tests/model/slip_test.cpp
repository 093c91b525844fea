// SPDX-License-Identifier: MIT
#include <bevel/model/slip.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace bevel::model {
namespace {

constexpr unsigned kSeed = 25;

NeedleParameters needle_with(double lambda1, double lambda2) {
  NeedleParameters needle;
  needle.lambda1_per_rad = lambda1;
  needle.lambda2 = lambda2;
  return needle;
}

TEST(Slip, ClosedFormSolvesTheSlipLawAndItsDerivativesAreRight) {
  RecordProperty("seed", kSeed);
  std::mt19937 rng(kSeed);
  std::uniform_real_distribution<double> tilt(1e-4, 0.7), l1(0.01, 0.8), l2(-0.2, 0.4);
  int checked = 0;
  for (int i = 0; i < 1000; ++i) {
    const double theta = tilt(rng), lambda1 = l1(rng), lambda2 = l2(rng);
    if (find_domain_violation(needle_with(lambda1, lambda2))) continue;
    const Slip slip = evaluate_slip(theta, lambda1, lambda2);
    ASSERT_TRUE(slip.in_domain);
    // (25) for gamma in [-pi/2, 0]: alpha = lambda1 gamma^2 + lambda2 gamma with gamma = -|gamma|.
    const double gamma = -slip.gamma_rad;
    EXPECT_NEAR(lambda1 * gamma * gamma + lambda2 * gamma, -slip.alpha_rad, 1e-14);
    EXPECT_NEAR(slip.gamma_rad - slip.alpha_rad, theta, 1e-14);
    EXPECT_NEAR(slip.f, std::tan(slip.alpha_rad), 1e-15);
    const double h = 1e-6;
    const auto f = [](double t, double a, double b) { return evaluate_slip(t, a, b).f; };
    EXPECT_NEAR(slip.f_by_tilt_per_rad, (f(theta + h, lambda1, lambda2) - f(theta - h, lambda1, lambda2)) / (2 * h),
                1e-7);
    EXPECT_NEAR(slip.f_by_lambda1_rad, (f(theta, lambda1 + h, lambda2) - f(theta, lambda1 - h, lambda2)) / (2 * h),
                1e-7);
    EXPECT_NEAR(slip.f_by_lambda2, (f(theta, lambda1, lambda2 + h) - f(theta, lambda1, lambda2 - h)) / (2 * h), 1e-7);
    ++checked;
  }
  EXPECT_GT(checked, 500);
}

TEST(Slip, ZeroLambdaIsTheBicycleToTheLastDigit) {
  const Slip slip = evaluate_slip(0.3, 0, 0);
  EXPECT_EQ(slip.f, 0.0);
  EXPECT_EQ(slip.alpha_rad, 0.0);
  EXPECT_EQ(slip.gamma_rad, 0.3);
  EXPECT_NEAR(slip.f_by_lambda2, 0.3, 1e-15);
  EXPECT_NEAR(slip.f_by_lambda1_rad, -0.09, 1e-15);
}

TEST(Slip, OutsideTheDomainIsSaidAndNeverANaN) {
  // (1 - lambda2)^2 + 4 lambda1 theta < 0: no real gamma.
  const Slip no_root = evaluate_slip(0.5, -0.9, 0.1);
  EXPECT_FALSE(no_root.in_domain);
  EXPECT_EQ(no_root.f, 0.0);
  const Slip past_90 = evaluate_slip(1.6, 0.001, 0.05);
  EXPECT_FALSE(past_90.in_domain);
  EXPECT_FALSE(evaluate_slip(0.1, 0.5, 1.2).in_domain);
}

struct BadNeedle {
  NeedleParameters needle;
  DomainRule rule;
  const char* named;
};

TEST(NeedleDomain, EveryRuleNamesTheValueAndTheLimit) {
  NeedleParameters bent = needle_with(0.4, 0.1);
  bent.curvature_per_mm = 0.3;
  NeedleParameters short_wheelbase = needle_with(0.4, 0.1);
  short_wheelbase.wheelbase_mm = -20;
  const BadNeedle bad[] = {
      {bent, DomainRule::curvature, "0.3"},
      {short_wheelbase, DomainRule::wheelbase, "-20"},
      {needle_with(std::nan(""), 0.1), DomainRule::lambda_finite, "nan"},
      {needle_with(0.001, 0.22), DomainRule::lambda1_bound, "(26)"},
      {needle_with(-0.1, 0.0), DomainRule::lambda1_bound, "-0.1"},
      {needle_with(0.9, 1.2), DomainRule::gamma_monotonic, "1.2"},
      {needle_with(3.0, 0.1), DomainRule::slip_below_90, "(23)"},
  };
  for (const BadNeedle& b : bad) {
    const auto violation = find_domain_violation(b.needle);
    ASSERT_TRUE(violation) << b.named;
    EXPECT_EQ(violation->rule, b.rule) << describe(*violation);
    EXPECT_NE(describe(*violation).find(b.named), std::string::npos) << describe(*violation);
  }
}

TEST(NeedleDomain, TableOneAndTheBicycleAreValid) {
  EXPECT_FALSE(find_domain_violation(needle_with(0.49, 0.22)));
  EXPECT_FALSE(find_domain_violation(needle_with(0.144, 0.032)));
  EXPECT_FALSE(find_domain_violation(needle_with(0, 0)));
}

}  // namespace
}  // namespace bevel::model
