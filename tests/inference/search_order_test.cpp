// SPDX-License-Identifier: MIT
// Which set is looked around next.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include <bevel/diagnosis/inference/search.hpp>

namespace bevel::inference {
namespace {

constexpr double kWindow = 3.5, kNone = -std::numeric_limits<double>::infinity();

std::map<ModelSet, Visited> visited_of(const std::vector<Visited>& list) {
  std::map<ModelSet, Visited> out;
  for (const Visited& one : list) out.emplace(one.set, one);
  return out;
}

Visited at(ModelSet set, double without, double with = kNone) {
  return {.set = std::move(set), .at = {}, .log_without_curve = without, .log_with_curve = with};
}

// In the order in which they are taken.
std::vector<ModelSet> order_of(const std::map<ModelSet, Visited>& visited) {
  std::vector<ModelSet> out;
  std::set<ModelSet> expanded;
  while (const ModelSet* next = next_to_expand(visited, expanded, kWindow))
    out.push_back(*next), expanded.insert(*next);
  return out;
}

TEST(NextToExpand, TheLikeliestFirstAndNoneBelowTheWindow) {
  EXPECT_EQ(order_of(visited_of({at({}, -9), at({1}, 0), at({2}, -2), at({3}, -3.4), at({2, 3}, -3.6)})),
            (std::vector<ModelSet>{{1}, {}, {2}, {3}}));  // then what it is without its one member
}

TEST(NextToExpand, OfSetsWithoutACurveTheLikeliestAreTakenHoweverFarBelowACurveTheyAre) {
  const auto order = order_of(visited_of({at({}, -130, 0), at({1}, -18), at({2}, -20), at({3}, -60)}));
  EXPECT_EQ(order, (std::vector<ModelSet>{{}, {1}, {2}}));
}

TEST(NextToExpand, WhatTheLikeliestIsWithoutOneMemberIsTakenHoweverFarBelow) {
  const auto order = order_of(visited_of({at({}, -300), at({1}, -200), at({2}, -100), at({1, 2}, 0)}));
  EXPECT_EQ(order, (std::vector<ModelSet>{{1, 2}, {1}, {2}}));
}

TEST(NextToExpand, NothingVisitedNothingNext) { EXPECT_EQ(next_to_expand({}, {}, kWindow), nullptr); }

}  // namespace
}  // namespace bevel::inference
