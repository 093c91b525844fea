// SPDX-License-Identifier: MIT
// The laws of the literature that steering is measured by: their closed forms, and what they do to a needle that bends
// along circles.
#include <bevel/rig/steering/baseline_steering.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include <bevel/model/kinematics.hpp>

namespace bevel::rig {
namespace {

constexpr unsigned kSeed = 11;
constexpr double kCurvature_per_mm = 0.005;
constexpr double kPeriod_s = 0.02;
constexpr double kPi = std::numbers::pi;

TEST(BaselineSteering, TheBevelFacesTheSideOnWhichTheTargetLies) {
  const model::Pose tip;  // for k > 0 its bevel bends it toward -y
  EXPECT_NEAR(sight(tip, kCurvature_per_mm, {0, -3, 50}).facing_rad, 0, 1e-12);
  EXPECT_NEAR(sight(tip, kCurvature_per_mm, {3, 0, 50}).facing_rad, kPi / 2, 1e-12);
  EXPECT_NEAR(std::abs(sight(tip, kCurvature_per_mm, {0, 3, 50}).facing_rad), kPi, 1e-12);
  model::Pose bent = tip;
  model::advance(bent, {20, 0, {kCurvature_per_mm, 0}}, {0, 0, 20});
  ASSERT_LT(bent.p_mm.y(), -0.5) << "it bends to where the law believes";
}

// By circles drawn through the origin along z: their points have the duty of their curvature.
TEST(BaselineSteering, DutyIsWhatTheCircleLeavesOfTheNeedlesCurvature) {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 200; ++i) {
    const double share = uniform(random), angle = 0.8 * uniform(random) + 0.05, side = 2 * kPi * uniform(random);
    const double radius_mm = 1 / (share * kCurvature_per_mm);
    const double aside_mm = radius_mm * (1 - std::cos(angle)), ahead_mm = radius_mm * std::sin(angle);
    const Sight s = sight({}, kCurvature_per_mm, {aside_mm * std::cos(side), aside_mm * std::sin(side), ahead_mm});
    EXPECT_NEAR(duty(s, kCurvature_per_mm), 1 - share, 1e-9) << "seed " << kSeed << ", " << i;
  }
  EXPECT_DOUBLE_EQ(duty({100, 0, 0}, kCurvature_per_mm), 1);
  EXPECT_DOUBLE_EQ(duty({50, 40, 0}, kCurvature_per_mm), 0) << "out of reach: all of its curvature";
}

struct Steered {
  model::Pose tip;
  double turned_rad = 0, duration_s = 0, inserted_mm = 0, farthest_wound_rad = 0;
};
// A needle without slip, whose pose and curvature the law knows, under the limits.
Steered steered(BaselineLaw law, const Eigen::Vector3d& target_mm) {
  const controller::SteeringLimits limits;
  BaselineSteering baseline(law, limits);
  Steered out;
  model::ActuatorState axes;
  controller::Rates before;
  while (out.duration_s < 200) {
    controller::NeedleView view;
    view.pose = out.tip;
    view.curvature_per_mm = kCurvature_per_mm;
    const controller::Rates rates = baseline.step(view, axes, target_mm, kPeriod_s);
    if (!baseline.moves()) break;
    EXPECT_LE(std::abs(rates.rotation_rad_s), limits.rotation_rate_rad_s);
    EXPECT_LE(std::abs(rates.rotation_rad_s - before.rotation_rad_s),
              limits.rotation_acceleration_rad_s2 * kPeriod_s + 1e-9);
    before = rates;
    const double mm = rates.insertion_mm_s * kPeriod_s, rad = rates.rotation_rad_s * kPeriod_s;
    model::advance(out.tip, {mm, rad, {kCurvature_per_mm, 0}}, {0, 0, 20});
    axes.insertion_mm += mm, axes.rotation_rad += rad;
    out.turned_rad += std::abs(rad), out.duration_s += kPeriod_s;
    out.farthest_wound_rad = std::max(out.farthest_wound_rad, std::abs(axes.rotation_rad));
  }
  EXPECT_TRUE(baseline.arrived());
  out.inserted_mm = axes.insertion_mm;
  return out;
}

TEST(BaselineSteering, DutyCycleComesToTargetsWithinReachWithATurnInEachCycle) {
  for (const double aside_mm : {0.0, 4.0, 8.0, 16.0, 20.0}) {
    const Eigen::Vector3d target(aside_mm * 0.6, aside_mm * 0.8, 100);
    const Steered r = steered(BaselineLaw::duty_cycle, target);
    EXPECT_LT((r.tip.p_mm - target).norm(), 1.0) << aside_mm;
    EXPECT_NEAR(r.turned_rad / (2 * kPi) / r.inserted_mm * DutyCycle::kCycle_mm, 1, 0.25) << aside_mm;
    EXPECT_LT(r.farthest_wound_rad, 5 * kPi) << "the cable is unwound";
  }
}

TEST(BaselineSteering, BangBangRestsUntilTheTargetIsPassed) {
  const controller::SteeringLimits limits;
  constexpr double kOther_mm = 1.1 * BangBang::kThreshold_mm;
  BangBang law;
  EXPECT_EQ(law.step({50, 2, 0}, 0, 0, limits).rotation_rad_s, 0) << "it faces it";
  EXPECT_EQ(law.step({50, 0.9 * BangBang::kThreshold_mm, kPi}, 0, 10, limits).rotation_rad_s, 0);
  EXPECT_EQ(law.step({50, 3, 0.4 * kPi}, 0, 10, limits).rotation_rad_s, 0) << "beside, not passed";
  const controller::Rates turns = law.step({50, kOther_mm, 0.9 * kPi}, 0, 10, limits);
  EXPECT_GT(turns.rotation_rad_s, 0);
  EXPECT_EQ(turns.insertion_mm_s, 0) << "at rest";
  EXPECT_NE(law.step({50, 0, 0}, 1.0, 10, limits).rotation_rad_s, 0) << "to its end";
  EXPECT_EQ(law.step({50, 0, 0}, 0.9 * kPi, 10, limits).rotation_rad_s, 0) << "there";
  const double kept_mm = 10 + BangBang::kKept_mm;
  EXPECT_EQ(law.step({50, kOther_mm, kPi}, 0.9 * kPi, kept_mm - 0.1, limits).rotation_rad_s, 0) << "not at once again";
  EXPECT_LT(law.step({50, kOther_mm, kPi}, 0.9 * kPi, kept_mm + 0.1, limits).rotation_rad_s, 0) << "and back";
  for (const double aside_mm : {0.0, 5.0, 15.0}) {
    const Eigen::Vector3d target(0, aside_mm, 100);
    EXPECT_LT((steered(BaselineLaw::bang_bang, target).tip.p_mm - target).norm(), 2 * BangBang::kThreshold_mm)
        << aside_mm;
  }
}

}  // namespace
}  // namespace bevel::rig
