// SPDX-License-Identifier: MIT
// What a set loses without a member, by the linear model: a way out of a local minimum.
#include <gtest/gtest.h>

#include <limits>

#include <bevel/diagnosis/inference/local_minima.hpp>
#include "tests/inference/linear_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::VectorXd;
using testing::LinearSystem;
using testing::white;

TEST(Dropping, CostsTheFallOfTheLikelihood) {
  const LinearSystem system(4, 7, 0.4, 0.2, 0);
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), white(system));
  const Scales scales{.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}};
  const auto fitted = [&](const ModelSet& set) {
    const Layout layout(system, set);
    Fit out = fit(*likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()), scales,
                  {}, {.tolerance = 1e-9});
    out.likelihood = likelihood;
    return out;
  };
  const Fit both = fitted({0, 1});
  const auto costs = log_costs_of_dropping(both);
  ASSERT_EQ(costs.size(), 2U);
  for (std::size_t m = 0; m < 2; ++m) EXPECT_NEAR(costs[m], 0.5 * (fitted({1 - m}).cost - both.cost), 1e-4 * costs[m]);
  EXPECT_GT(costs[0], 10);  // a parabola of four deviations at its ends, of which the cosine may take much
  EXPECT_LT(costs[1], 5);   // no step
}

// A set would hold what is none of it for certain, were it not begun again without.
TEST(Dropping, WhatPressesAgainstNoneCostsNothing) {
  const LinearSystem system(4, 7, 0.4, 0.2, 0);
  const auto likelihood = std::make_shared<const Likelihood>(system, Readings(4), white(system));
  const Layout layout(system, {0, 1});
  Fit pressed = fit(*likelihood, layout, layout.shared_start(), std::vector<VectorXd>(4, layout.local_start()),
                    {.nuisance_sd = VectorXd::Constant(1, 0.2), .curves = {}}, {}, {.tolerance = 1e-9});
  pressed.likelihood = likelihood;
  const Eigen::Index size = layout.find_shared(1, 0);
  pressed.held = {size};
  pressed.shared[size] = layout.shared()[static_cast<std::size_t>(size)].parameter->none;
  EXPECT_EQ(log_costs_of_dropping(pressed)[1], 0);
  pressed.shared[size] += 0.3;  // another bound
  EXPECT_EQ(log_costs_of_dropping(pressed)[1], std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace bevel::inference
