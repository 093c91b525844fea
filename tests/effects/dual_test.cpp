// SPDX-License-Identifier: MIT
// Elementary functions of dual numbers, their slopes against central differences.
#include <bevel/model/effects/dual.hpp>

#include <gtest/gtest.h>

#include <functional>

namespace bevel::model {
namespace {

TEST(Dual, FunctionsHaveTheirSlopes) {
  const std::function<Dual(const Dual&)> functions[] = {
      [](const Dual& x) { return exp(x); },           [](const Dual& x) { return sqrt(x); },
      [](const Dual& x) { return sin(x); },           [](const Dual& x) { return cos(x); },
      [](const Dual& x) { return pow(0.3, x); },      [](const Dual& x) { return pow(1.0, x); },
      [](const Dual& x) { return pow(2.7, x); },      [](const Dual& x) { return 2.0 / x; },
      [](const Dual& x) { return exp(-x) / (x * x); }};
  constexpr double kStep = 1e-5;
  for (std::size_t f = 0; f < std::size(functions); ++f)
    for (const double at : {0.4, 1.0, 2.9}) {
      const double difference = (functions[f](at + kStep).value - functions[f](at - kStep).value) / (2 * kStep);
      EXPECT_NEAR(functions[f](Dual::unknown(at, 2)).slope()[2], difference, 1e-7) << f << " at " << at;
    }
}

TEST(Dual, WhatNoUnknownMovesHasNoSlope) {
  const Dual constant = exp(Dual(0.3)) * 2.0 + 1.0;
  EXPECT_FALSE(constant.moves());
  EXPECT_EQ(constant.slope().matrix().norm(), 0);
  Dual x = Dual::unknown(2, 3);
  const Dual product = constant * x, sum = x + constant, quotient = constant / x;
  EXPECT_EQ(product.slope()[3], constant.value);
  EXPECT_EQ(sum.slope()[3], 1);
  EXPECT_EQ(quotient.slope()[3], -constant.value / 4);
  x = constant;  // and forgets it where it is overwritten
  EXPECT_FALSE(x.moves());
  x += Dual::unknown(1, 5);
  EXPECT_EQ(x.slope()[3], 0);
  EXPECT_EQ(x.slope()[5], 1);
}

TEST(Dual, NothingToAPowerIsNothing) {
  const Dual zero = pow(0.0, Dual::unknown(1.5, 0));
  EXPECT_EQ(zero.value, 0);
  EXPECT_EQ(zero.slope()[0], 0);
}

}  // namespace
}  // namespace bevel::model
