// SPDX-License-Identifier: MIT
// Which spread is fitted next: the most promising, none twice, and nearer where the linear model was wrong.
#include <bevel/diagnosis/inference/spread_search.hpp>

#include <gtest/gtest.h>

#include <cmath>

#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kValues = 9;

// Two groups of nine standard deviations: column a + 9 b.
class TwoGroups final : public testing::HeldSystem {
 public:
  TwoGroups() {
    std::vector<double> values;
    for (Index i = 0; i < kValues; ++i) values.push_back(static_cast<double>(i));
    groups_ = {{"a", "mm", values}, {"b", "mm", values}};
  }
  bool predict(const ModelSet&, std::size_t, const VectorXd&, const VectorXd&, bool, Prediction&) const override {
    return false;
  }
  Eigen::MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }
};

VectorXd promises(const std::initializer_list<std::pair<Index, double>>& some) {
  VectorXd out = VectorXd::Zero(kValues * kValues);
  for (const auto& [at, value] : some) out[at] = value;
  return out;
}

TEST(SpreadSearch, ColumnsAreAsFarApartAsTheGroupThatDiffersMost) {
  const TwoGroups system;
  const NuisanceGrid grid = nuisance_grid(system);
  for (Index i = 0; i < kValues * kValues; ++i)
    for (Index j = 0; j < kValues * kValues; ++j) {
      const VectorXd steps = grid.standard_deviations.col(i) - grid.standard_deviations.col(j);
      EXPECT_EQ(apart(system, i, j), static_cast<Index>(std::lround(steps.cwiseAbs().maxCoeff())));
    }
}

TEST(SpreadSearch, TheMostPromisingIsNextAndNoneTwice) {
  const TwoGroups system;
  SpreadSearch spreads(system);
  const VectorXd promised = promises({{5, 1}, {40, 3}, {80, 2}});
  std::vector<Index> order;
  for (Index next = spreads.next(promised, 0, 0.2); next != 0; next = spreads.next(promised, 0, 0.2)) {
    order.push_back(next);
    spreads.tried(next);
  }
  EXPECT_EQ(order, (std::vector<Index>{40, 80, 5}));
  EXPECT_EQ(SpreadSearch(system).next(promises({{5, 0.1}}), 0, 0.2), 0);
}

TEST(SpreadSearch, WhereAPromiseWasBrokenOnlyNearerOnesAreBelieved) {
  const TwoGroups system;
  SpreadSearch spreads(system);
  const VectorXd promised = promises({{8, 9}, {7, 8}, {5, 7}, {4, 6}, {3, 5}, {2, 4}, {1, 3}});
  // From 0 all are in one group: 8 steps, then at most 4, 2, 1, none.
  std::vector<Index> order;
  for (Index next = spreads.next(promised, 0, 0.2); next != 0; next = spreads.next(promised, 0, 0.2)) {
    order.push_back(next);
    spreads.tried(next);
    spreads.lost(next, 0);
  }
  EXPECT_EQ(order, (std::vector<Index>{8, 4, 2, 1}));
  // A gain widens it again.
  SpreadSearch again(system);
  again.lost(8, 0);
  EXPECT_EQ(again.next(promised, 0, 0.2), 4);
  again.gained();
  EXPECT_EQ(again.next(promised, 0, 0.2), 8);
}

}  // namespace
}  // namespace bevel::inference
