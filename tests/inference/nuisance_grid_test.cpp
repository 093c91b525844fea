// SPDX-License-Identifier: MIT
// Combinations of standard deviations: that those with a share are found from any of them, and few others asked for.
#include <bevel/diagnosis/inference/nuisance_grid.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

class Grouped final : public testing::HeldSystem {
 public:
  Grouped() {
    groups_ = {{"a", "mm", {0, 0.02, 0.05, 0.12, 0.3}},
               {"b", "mm", {0, 0.003, 0.007, 0.015, 0.03}},
               {"c", "rad", {0, 0.05, 0.12, 0.3, 0.8}},
               {"d", "rad", {0, 0.015, 0.04, 0.1}}};
  }
  bool predict(const ModelSet&, std::size_t, const VectorXd&, const VectorXd&, bool, Prediction&) const override {
    return false;
  }
  Eigen::MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }
};

TEST(NuisanceGrid, PriorsAddUpToOne) {
  const NuisanceGrid grid = nuisance_grid(Grouped());
  ASSERT_EQ(grid.log_prior.size(), 500);
  EXPECT_NEAR(grid.log_prior.array().exp().sum(), 1, 1e-12);
  EXPECT_NEAR(std::exp(grid.log_prior[0]), 0.5 + 0.5 / 500, 1e-12);
  for (Index k = 1; k < 500; ++k) EXPECT_NEAR(std::exp(grid.log_prior[k]), 0.5 / 500, 1e-12);
}

TEST(NuisanceGrid, LessSpreadIsWithoutOneGroupOrWithoutAll) {
  EXPECT_TRUE(less_spread(Eigen::Vector3d::Zero()).empty());
  const auto of_one = less_spread(Eigen::Vector3d(0, 2, 0));
  ASSERT_EQ(of_one.size(), 1U);
  EXPECT_TRUE(of_one.front().isZero(0));
  const auto of_two = less_spread(Eigen::Vector3d(1, 0, 3));
  ASSERT_EQ(of_two.size(), 3U);
  EXPECT_EQ(of_two[0], Eigen::Vector3d(0, 0, 3));
  EXPECT_EQ(of_two[1], Eigen::Vector3d(1, 0, 0));
  EXPECT_TRUE(of_two[2].isZero(0));
}

TEST(NuisanceGrid, OneStepLessSpreadIsTheNextSmallerValueOfAGroup) {
  const Grouped system;
  EXPECT_TRUE(one_step_less_spread(system, Eigen::Vector4d::Zero()).empty());
  const auto values = [&](std::size_t group) { return system.nuisance_groups()[group].standard_deviations; };
  const Eigen::Vector4d from(values(0)[3], 0, values(2)[1], 0);
  const auto less = one_step_less_spread(system, from);
  ASSERT_EQ(less.size(), 2U);
  EXPECT_EQ(less[0], Eigen::Vector4d(values(0)[2], 0, from[2], 0));
  EXPECT_EQ(less[1], Eigen::Vector4d(from[0], 0, 0, 0));
}

// A peak where recordings differ in every way, beside that where they differ in none, with much less between.
TEST(NuisanceGrid, BothPeaksAreFound) {
  const Grouped system;
  const Index sizes[] = {5, 5, 5, 4};
  constexpr Index kPeak = 2 + 5 * (2 + 5 * (2 + 5 * 1));
  const auto log_at = [&](Index k) {
    if (k == 0) return -1.0;
    double squares = 0;
    Index peak = kPeak;
    for (const Index size : sizes) {
      squares += std::pow(static_cast<double>(k % size - peak % size), 2);
      k /= size, peak /= size;
    }
    return -squares / 0.3;
  };
  for (const Index start : {Index{0}, kPeak, Index{499}}) {
    const VectorXd found = over_likely(system, start, 6, log_at);
    EXPECT_EQ(found[0], -1) << start;
    EXPECT_EQ(found[kPeak], 0) << start;
  }
}

// A density with one peak over the places of the groups' values, from the farthest corners: all of its mass but what is
// so far below, and with 0 the peak.
TEST(NuisanceGrid, WhatHasAShareIsFoundFromAnyStart) {
  const Grouped system;
  const NuisanceGrid grid = nuisance_grid(system);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(0, 4), width(0.3, 1);
  const Index sizes[] = {5, 5, 5, 4};
  constexpr double kFarBelow = 6;
  for (int trial = 0; trial < 50; ++trial) {
    const double at[] = {place(random), place(random), place(random), 0.75 * place(random)};
    const double sd = width(random);
    int asked = 0;
    const auto log_at = [&](Index k) {
      double squares = 0;
      for (std::size_t g = 0; g < 4; k /= sizes[g], ++g)
        squares += std::pow(static_cast<double>(k % sizes[g]) - at[g], 2);
      return -0.5 * squares / (sd * sd);
    };
    for (const Index start : {Index{0}, Index{499}, Index{257}}) {
      EXPECT_EQ(column_of(system, grid.standard_deviations.col(start)), start);
      asked = 0;
      const VectorXd found = over_likely(system, start, kFarBelow, [&](Index k) {
        ++asked;
        return log_at(k);
      });
      EXPECT_EQ(over_likely(system, start, 0, log_at).maxCoeff(), found.maxCoeff());
      VectorXd all(500);
      for (Index k = 0; k < 500; ++k) all[k] = log_at(k);
      const double most = all.maxCoeff();
      EXPECT_EQ(found.maxCoeff(), most) << "trial " << trial << ", from " << start;
      double missed = 0;
      for (Index k = 0; k < 500; ++k) {
        if (std::isfinite(found[k])) {
          EXPECT_EQ(found[k], all[k]);
        } else {
          missed += std::exp(all[k] - most);
        }
      }
      EXPECT_LT(missed, 500 * std::exp(-kFarBelow));
      EXPECT_LE(asked, 500);
    }
    if (sd < 0.5) {
      EXPECT_LT(asked, 250) << "trial " << trial;
    }
  }
}

}  // namespace
}  // namespace bevel::inference
