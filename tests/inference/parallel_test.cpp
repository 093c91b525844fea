// SPDX-License-Identifier: MIT
// What comes out does not depend on how many threads it took.
#include <gtest/gtest.h>

#include <bevel/diagnosis/inference/posterior.hpp>
#include "tests/inference/pendulum.hpp"

namespace bevel::inference {
namespace {

TEST(ParallelSearch, ManyThreadsSayTheSame) {
  testing::TruePendulum truth;
  truth.dry_friction = 0.2;
  const testing::Pendulum system(truth, 3, 61);
  Noise noise;
  noise.sigma = {testing::Pendulum::kSigma_rad};
  noise.frame_s = testing::Pendulum::kFrame_s;
  Search one(system, {.threads = 1}), four(system, {.threads = 4});
  one.run(Readings(3), noise);
  four.run(Readings(3), noise);
  ASSERT_EQ(one.visited().size(), four.visited().size());
  for (const auto& [set, visited] : one.visited()) {
    const Visited& same = four.visited().at(set);
    EXPECT_EQ(visited.log_without_curve, same.log_without_curve) << describe(system, set);
    EXPECT_EQ(visited.log_with_curve, same.log_with_curve) << describe(system, set);
    EXPECT_EQ(visited.at->fit.shared, same.at->fit.shared) << describe(system, set);
  }
  const auto left_out = leave_out_selection(one), the_same = leave_out_selection(four);
  for (std::size_t r = 0; r < 3; ++r) EXPECT_EQ(left_out[r].log_density, the_same[r].log_density);
}

}  // namespace
}  // namespace bevel::inference
