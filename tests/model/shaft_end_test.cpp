// SPDX-License-Identifier: MIT
#include <bevel/model/shaft_end.hpp>

#include <gtest/gtest.h>

namespace bevel::model {
namespace {

TEST(ShaftEnd, IsHetenyisQuotient) {
  for (const double x : {0.05, 0.44, 1.0, 2.3, 4.0, 8.0}) {
    const double S = std::sinh(x), C = std::cosh(x), s = std::sin(x), c = std::cos(x);
    const ShaftEnd end = shaft_end(x);
    EXPECT_NEAR(end.g, (S * C - s * c) / (C * C + c * c), 1e-12) << x;
    EXPECT_NEAR(end.h, (S * S + s * s) / (C * C + c * c), 1e-12) << x;
  }
}

// A short end is a cantilever whose tissue does not matter: F x^3 / 3 EI against F / (2 EI lambda^3), and F x^2 / 2 EI
// against F / (2 EI lambda^2).
TEST(ShaftEnd, AShortEndIsACantileverAndADeepOneYieldsInFull) {
  const double x = 0.02;
  EXPECT_NEAR(shaft_end(x).g, 2.0 / 3 * x * x * x, 1e-6 * x);
  EXPECT_NEAR(shaft_end(x).h, x * x, 1e-6);
  EXPECT_NEAR(shaft_end(14).g, 1, 1e-10);
  EXPECT_NEAR(shaft_end(14).h, 1, 1e-10);
  EXPECT_EQ(shaft_end(0).g, 0);
  EXPECT_EQ(shaft_end(1000).h, shaft_end(15).h);
}

TEST(ShaftEnd, DerivativesAgreeWithDifferences) {
  const double step = 1e-6;
  for (const double x : {0.1, 0.7, 1.9, 3.3, 9.0}) {
    EXPECT_NEAR(shaft_end(x).g_by_x, (shaft_end(x + step).g - shaft_end(x - step).g) / (2 * step), 1e-8) << x;
    EXPECT_NEAR(shaft_end(x).h_by_x, (shaft_end(x + step).h - shaft_end(x - step).h) / (2 * step), 1e-8) << x;
  }
}

}  // namespace
}  // namespace bevel::model
