// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/statistics/ljung_box.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace bevel::diagnosis {
namespace {

// By hand: 1 2 3 4 less 2.5 has autocorrelations 1.25/5, -1.5/5 and -2.25/5, so that over two lags
// Q = 4 * 6 * (0.25^2/3 + 0.3^2/2) = 1.58, and over three 24 * 0.45^2/1 more: 6.44.
const Eigen::Vector4d kRamp(1, 2, 3, 4);

TEST(LjungBox, IsThatComputedByHand) {
  const LjungBox two = ljung_box(kRamp, 2);
  EXPECT_EQ(two.lags, 2);
  EXPECT_NEAR(two.statistic, 1.58, 1e-14);
  // Chi-square of two degrees of freedom is an exponential distribution.
  EXPECT_NEAR(two.p_value, std::exp(-1.58 / 2), 1e-14);
}

TEST(LjungBox, LosesADegreeOfFreedomToEveryFittedCoefficient) {
  const LjungBox three = ljung_box(kRamp, 3, 1);
  EXPECT_NEAR(three.statistic, 6.44, 1e-14);
  EXPECT_NEAR(three.p_value, std::exp(-6.44 / 2), 1e-14);
  // One degree is left however many were fitted: P(chi-square_1 > Q) is erfc(sqrt(Q/2)).
  EXPECT_NEAR(ljung_box(kRamp, 2, 5).p_value, std::erfc(std::sqrt(1.58 / 2)), 1e-14);
}

TEST(LjungBox, TakesTheMeanAndTheUnitOut) { EXPECT_NEAR(ljung_box(100 * kRamp.array() + 7, 2).statistic, 1.58, 1e-12); }

TEST(LjungBox, SaysNothingOfTooFewValuesOrEqualOnes) {
  EXPECT_EQ(ljung_box(kRamp, 4).p_value, 1);
  EXPECT_EQ(ljung_box(Eigen::VectorXd(), 1).p_value, 1);
  EXPECT_EQ(ljung_box(Eigen::VectorXd::Constant(50, 3.0), 12).p_value, 1);
}

Eigen::VectorXd formula_series(double share) {
  Eigen::VectorXd x(80);
  for (int i = 1; i <= 80; ++i) x[i - 1] = std::sin(0.37 * i * i) + share * std::sin(0.9 * i);
  return x;
}

// statsmodels 0.15.0: i = numpy.arange(1, 81); x = sin(0.37*i*i) + a*sin(0.9*i);
// statsmodels.stats.diagnostic.acorr_ljungbox(x, lags=[12], model_df=df): lb_pvalue.
TEST(LjungBox, IsThatOfStatsmodels) {
  EXPECT_NEAR(ljung_box(formula_series(0.3), 12, 0).p_value, 0.83635948, 1e-7);
  EXPECT_NEAR(ljung_box(formula_series(0.3), 12, 1).p_value, 0.7733244, 1e-7);
  EXPECT_NEAR(ljung_box(formula_series(0.6), 12, 0).p_value, 2.89400255e-03, 1e-10);
  EXPECT_NEAR(ljung_box(formula_series(0.6), 12, 1).p_value, 1.64477274e-03, 1e-10);
}

TEST(LjungBox, IsUniformOnWhiteNoise) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  constexpr int kSeries = 500;
  std::vector<double> p;
  for (int s = 0; s < kSeries; ++s) {
    Eigen::VectorXd white(400);
    for (double& x : white) x = normal(random);
    p.push_back(ljung_box(white, 12, 0).p_value);
  }
  std::sort(p.begin(), p.end());
  double distance = 0;  // Kolmogorov and Smirnov
  for (int s = 0; s < kSeries; ++s) {
    const double at = p[static_cast<std::size_t>(s)];
    distance = std::max({distance, (s + 1.0) / kSeries - at, at - static_cast<double>(s) / kSeries});
  }
  EXPECT_LT(distance, 1.95 / std::sqrt(kSeries)) << "seed 9; 0.1 %";
}

}  // namespace
}  // namespace bevel::diagnosis
