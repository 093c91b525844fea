// SPDX-License-Identifier: MIT
// No allocation in a step, late measurements, resets and relinearisation included: operator new is counted.
#include <gtest/gtest.h>

#include <bevel/estimator/needle_estimator.hpp>
#include "tests/estimator/play.hpp"
#include "tests/support/count_allocations.hpp"

namespace bevel::estimator {
namespace {

void expect_no_allocation(double wheelbase_sd_mm, double heading_sd_rad = 0, double correlated_share = 0,
                          const NuisancePrior& nuisance = {}) {
  std::mt19937_64 rng(21);
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.prior.wheelbase_sd_mm = wheelbase_sd_mm;
  config.reading = {.correlated_share = correlated_share, .correlation_mm = 2};
  config.nuisance = nuisance;
  testing::InsertionPlan plan;
  plan.cameras = 2;
  plan.heading_sd_rad = heading_sd_rad;
  testing::Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  for (std::size_t i = 300; i < 340; ++i)
    data.measurements[i].position_mm += Eigen::Vector3d(10, 10, 0);  // brings a reset
  NeedleEstimator estimator(config);
  for (std::size_t i = 500; i < data.headings.size() && i < 510; ++i) data.headings[i].heading *= -1;  // refused
  std::size_t next = 0, next_heading = 0;
  const long before = bevel::testing::allocations;
  for (const auto& actuator : data.actuators) {
    estimator.add(actuator);
    while (next < data.measurements.size() && data.measurements[next].utime + 60'000 < actuator.utime)
      estimator.add(data.measurements[next++]);
    while (next_heading < data.headings.size() && data.headings[next_heading].utime + 40'000 < actuator.utime)
      estimator.add(data.headings[next_heading++]);
    (void)estimator.estimate(actuator.utime);
  }
  EXPECT_EQ(bevel::testing::allocations - before, 0);
  EXPECT_GT(estimator.counters().positions.late, 100);
  EXPECT_EQ(estimator.counters().relinearised > 0, !nuisance.any());
  EXPECT_EQ(estimator.counters().headings.late > 100, heading_sd_rad > 0);
  EXPECT_GT(estimator.estimate(data.actuators.back().utime).state.reset_count, 0);
}

TEST(NeedleEstimator, AllocatesNothingInAStep) { expect_no_allocation(0); }

TEST(NeedleEstimator, AllocatesNothingInAStepWithEllAsAState) { expect_no_allocation(5); }

TEST(NeedleEstimator, AllocatesNothingInAStepWithHeadings) {
  expect_no_allocation(0, 0.02);
  expect_no_allocation(5, 0.02);
}

TEST(NeedleEstimator, AllocatesNothingInAStepWithSharedErrors) {
  expect_no_allocation(0, 0.02, 0.8);
  expect_no_allocation(5, 0, 0.8);
}

TEST(NeedleEstimator, AllocatesNothingInAStepWithNuisanceStates) {
  const NuisancePrior nuisance{.windup_sd_rad = 0.4, .latency_sd_s = 0.02};
  expect_no_allocation(0, 0.02, 0, nuisance);
  expect_no_allocation(5, 0.02, 0.8, nuisance);
}

TEST(NeedleEstimator, AllocatesNothingInAStepWithEffects) {
  std::mt19937_64 rng(22);
  EstimatorConfig config;
  for (const char* name : {"torsional_windup", "camera_latency", "relaxation", "flip_transient"}) {
    model::ActiveEffect active;
    active.effect = model::find_effect(name);
    ASSERT_NE(active.effect, nullptr) << name;
    for (std::size_t i = 0; i < active.effect->parameters().size(); ++i)
      active.parameters[i] = active.effect->parameters()[i].starts.front();
    config.effects.push_back(active);
  }
  testing::InsertionPlan plan;
  plan.heading_sd_rad = 0.02;
  const testing::Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  NeedleEstimator estimator(config);
  const long before = bevel::testing::allocations;
  testing::play(estimator, data, 60'000);
  EXPECT_EQ(bevel::testing::allocations - before, 0);
  EXPECT_GT(estimator.counters().positions.late, 100);
}

}  // namespace
}  // namespace bevel::estimator
