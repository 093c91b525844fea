// SPDX-License-Identifier: MIT
// What was predicted last is not computed again, and is the same to the last bit.
#include <bevel/diagnosis/inference/prediction_memo.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include <bevel/diagnosis/parallel.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class Counting final : public testing::HeldSystem {
 public:
  explicit Counting(std::size_t recordings) { data_.recordings.resize(recordings); }
  bool predict(const ModelSet& set, std::size_t recording, const VectorXd& shared, const VectorXd& local,
               bool derivatives, Prediction& out) const override {
    ++count;
    if (shared[0] < 0) return false;
    const double effects = static_cast<double>(set.size()), r = static_cast<double>(recording);
    out.reading = VectorXd::Constant(3, std::sin(shared[0] + r) + effects * std::exp(local[0]));
    if (derivatives) out.by_shared = MatrixXd::Constant(3, 1, std::cos(shared[0] + r));
    return true;
  }
  MatrixXd by_curves(std::size_t, const VectorXd&) const override { return {}; }
  mutable std::atomic<int> count{0};
};

VectorXd one(double value) { return VectorXd::Constant(1, value); }

TEST(PredictionMemo, ComputesWhatIsNew) {
  const Counting system(2);
  PredictionMemo memo(system);
  const auto first = memo.predict({1}, 0, one(0.3), one(0.2), true);
  EXPECT_EQ(memo.predict({1}, 0, one(0.3), one(0.2), true), first);
  EXPECT_EQ(system.count, 1);
  // Another recording, set, unknown of either kind, or without derivatives: each of its own.
  memo.predict({1}, 1, one(0.3), one(0.2), true);
  memo.predict({2}, 0, one(0.3), one(0.2), true);
  memo.predict({1}, 0, one(std::nextafter(0.3, 1)), one(0.2), true);
  memo.predict({1}, 0, one(0.3), one(0.25), true);
  EXPECT_EQ(memo.predict({1}, 0, one(0.3), one(0.2), false)->by_shared.size(), 0);
  EXPECT_EQ(system.count, 6);
  // That which was asked least lately is forgotten, not one that was asked again.
  EXPECT_EQ(memo.predict({1}, 0, one(0.3), one(0.2), true), first);
  EXPECT_EQ(system.count, 6);
  for (int i = 0; i < 4; ++i) memo.predict({1}, 0, one(1.0 + i), one(0.2), true);
  EXPECT_NE(memo.predict({1}, 0, one(0.3), one(0.2), true), first);
  EXPECT_EQ(system.count, 11);
}

TEST(PredictionMemo, OutsideTheDomainThereIsNothing) {
  const Counting system(1);
  PredictionMemo memo(system);
  EXPECT_EQ(memo.predict({}, 0, one(-1), one(0), true), nullptr);
  EXPECT_EQ(memo.predict({}, 0, one(-1), one(0), true), nullptr);
}

TEST(PredictionMemo, ThreadsSeeTheSameBits) {
  const Counting system(3);
  PredictionMemo memo(system);
  constexpr std::size_t kAsked = 3000;
  constexpr int kThreads = 4;
  std::vector<int> wrong(kAsked);
  parallel_for(kAsked, kThreads, [&](std::size_t i) {
    const std::size_t r = i % 3;
    const VectorXd shared = one(0.1 * static_cast<double>(i / 3 % 2));
    Prediction expected;
    system.predict({0}, r, shared, one(0.5), true, expected);
    const auto found = memo.predict({0}, r, shared, one(0.5), true);
    wrong[i] = found->reading != expected.reading || found->by_shared != expected.by_shared;
  });
  EXPECT_EQ(std::count(wrong.begin(), wrong.end(), 0), static_cast<std::ptrdiff_t>(kAsked));
  // Two values of each recording, each computed once, or by all threads that asked before it was known.
  EXPECT_LE(system.count, static_cast<int>(kAsked) + 3 * 2 * kThreads);
}

}  // namespace
}  // namespace bevel::inference
