// SPDX-License-Identifier: MIT
// Parameters learned on other insertions: what one log's filter has learned starts another's.
#include <bevel/analysis/replay/held_out.hpp>

#include <gtest/gtest.h>

#include <iostream>

#include "tests/estimator/insertion.hpp"

namespace bevel::analysis {
namespace {

constexpr unsigned kSeed = 23;
constexpr double kTrueCurvature_per_mm = 0.0062;

estimator::EstimatorConfig prior_config() {
  estimator::EstimatorConfig config;
  config.prior.needle.curvature_per_mm = 0.0047;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.prior.curvature_sd_per_mm = 0.002;
  config.process.curvature_per_mm = config.process.lambda1_per_rad = config.process.lambda2 = 0;
  config.relinearised_steps = 0;
  return config;
}

Replay replay_of(double curvature_per_mm, const estimator::EstimatorConfig& config, std::mt19937_64& rng) {
  model::NeedleParameters truth = config.prior.needle;
  truth.curvature_per_mm = curvature_per_mm;
  const auto data = estimator::testing::insert(truth, {}, {}, rng);
  estimator::NeedleEstimator estimator(config);
  std::size_t next = 0;
  Replay replay;
  replay.config = config;
  for (const auto& actuator : data.actuators) {
    while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
      estimator.add(data.measurements[next++]);
    estimator.add(actuator);
  }
  replay.states.push_back({.state = estimator.estimate(data.actuators.back().utime).state});
  return replay;
}

TEST(HeldOut, OfTwoLogsEachStartsWhereTheOtherEnded) {
  std::mt19937_64 rng(kSeed);
  const std::vector<Replay> replays = {replay_of(0.0050, prior_config(), rng),
                                       replay_of(kTrueCurvature_per_mm, prior_config(), rng)};
  const auto configs = held_out_configs(replays, 0.3);
  ASSERT_EQ(configs.size(), 2U);
  for (const std::size_t own : {0U, 1U}) {
    const estimator::FilterState other = replays[1 - own].states.back().state.unpacked();
    const estimator::Prior& prior = configs[own].prior;
    EXPECT_NEAR(prior.needle.curvature_per_mm, other.curvature_per_mm, 1e-9);
    EXPECT_NEAR(prior.needle.lambda1_per_rad, other.lambda1_per_rad, 1e-6);
    EXPECT_NEAR(prior.needle.lambda2, other.lambda2, 1e-6);
    EXPECT_DOUBLE_EQ(prior.curvature_sd_per_mm, 0.3 * prior_config().prior.curvature_sd_per_mm);
    EXPECT_DOUBLE_EQ(prior.lambda1_sd_per_rad, 0.3 * prior_config().prior.lambda1_sd_per_rad);
    EXPECT_DOUBLE_EQ(prior.lambda2_sd, 0.3 * prior_config().prior.lambda2_sd);
  }
}

TEST(HeldOut, MoreLogsLeaveTheTruthCloserAndTheOwnOneHasNoPart) {
  std::mt19937_64 rng(kSeed);
  std::vector<Replay> replays = {replay_of(0.0030, prior_config(), rng)};  // another tissue, as it were
  for (int i = 0; i < 4; ++i) replays.push_back(replay_of(kTrueCurvature_per_mm, prior_config(), rng));
  const double learned = held_out_configs(replays, 1)[0].prior.needle.curvature_per_mm;
  std::cout << "k learned " << learned << ", true " << kTrueCurvature_per_mm << ", prior "
            << prior_config().prior.needle.curvature_per_mm << ", seed " << kSeed << "\n";
  EXPECT_NEAR(learned, kTrueCurvature_per_mm, 3e-4);
  replays[0] = replay_of(0.0040, prior_config(), rng);
  EXPECT_EQ(held_out_configs(replays, 1)[0].prior.needle.curvature_per_mm, learned);
}

TEST(HeldOut, WhatIsHeldFixedStays) {
  std::mt19937_64 rng(kSeed);
  estimator::EstimatorConfig bicycle = prior_config();
  bicycle.prior.needle.lambda1_per_rad = bicycle.prior.needle.lambda2 = 0;
  bicycle.prior.lambda1_sd_per_rad = bicycle.prior.lambda2_sd = 0;
  const std::vector<Replay> replays = {replay_of(0.005, bicycle, rng), replay_of(0.006, bicycle, rng)};
  const estimator::Prior prior = held_out_configs(replays, 0.5)[0].prior;
  EXPECT_EQ(prior.needle.lambda1_per_rad, 0);
  EXPECT_EQ(prior.needle.lambda2, 0);
  EXPECT_EQ(prior.lambda2_sd, 0);
  EXPECT_NEAR(prior.needle.curvature_per_mm, replays[1].states.back().state.curvature_per_mm, 1e-9);
}

}  // namespace
}  // namespace bevel::analysis
