// SPDX-License-Identifier: MIT
#include <bevel/estimator/innovation_watch.hpp>

#include <gtest/gtest.h>

#include <random>

namespace bevel::estimator {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;

// Frames at 30 Hz of two axes, with a variance of so much of what was expected; share of frames with a ratio too large.
double said(double variance, unsigned seed, double& last_ratio) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal(0, std::sqrt(variance));
  InnovationWatch watch;
  int too_large = 0;
  constexpr int kFrames = 3000;
  for (int i = 0; i < kFrames; ++i) {
    const double a = normal(rng), b = normal(rng);
    watch.see(1, kStart_utime + i * 33'333, a * a + b * b, 2);
    too_large += watch.channels().at(1).is_too_large() ? 1 : 0;
  }
  last_ratio = watch.channels().at(1).ratio();
  return too_large / static_cast<double>(kFrames);
}

TEST(InnovationWatch, IsOneWhereFilterAndNeedleAgreeAndSaysWhereTheyDoNot) {
  constexpr unsigned kSeed = 8;
  double ratio = 0;
  EXPECT_LT(said(1.0, kSeed, ratio), 0.01);
  EXPECT_NEAR(ratio, 1, 0.4);
  EXPECT_LT(said(0.5, kSeed, ratio), 1e-9);
  EXPECT_GT(said(2.5, kSeed, ratio), 0.97);
  EXPECT_NEAR(ratio, 2.5, 1);
}

TEST(InnovationWatch, ForgetsWithinSecondsAndKeepsCamerasApart) {
  InnovationWatch watch;
  for (int i = 0; i < 300; ++i) watch.see(0, kStart_utime + i * 33'333, 20, 2);
  EXPECT_TRUE(watch.channels().at(0).is_too_large());
  watch.see(2, kStart_utime, 2, 2);
  EXPECT_FALSE(watch.channels().at(2).is_too_large()) << "of one frame nothing is said";
  for (int i = 300; i < 900; ++i) watch.see(0, kStart_utime + i * 33'333, 2, 2);
  EXPECT_NEAR(watch.channels().at(0).ratio(), 1, 0.05);
  watch.restart();
  EXPECT_TRUE(watch.channels().empty());
}

}  // namespace
}  // namespace bevel::estimator
