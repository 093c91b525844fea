#include "diagnosis/statistics/ljung_box.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace bevel::diagnosis
