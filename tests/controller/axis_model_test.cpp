// SPDX-License-Identifier: MIT
// The dead band between base and tip, against its closed form; and what it is worth on the way to a roll.
#include <bevel/controller/axis_model.hpp>

#include <gtest/gtest.h>

#include <cmath>

#include "tests/effects/script.hpp"

namespace bevel::controller {
namespace {

using model::testing::active;

model::ActuatorState axes_at(double insertion_mm, double rotation_rad, std::int64_t utime = 1'700'000'000'000'000) {
  model::ActuatorState state;
  state.utime = utime;
  state.insertion_mm = insertion_mm;
  state.rotation_rad = rotation_rad;
  return state;
}

TEST(AxisModel, BacklashIsHalfAWidthAtFirstAndAWholeOneAfterATurn) {
  AxisModel axes({active("rotation_backlash", {0.4})});
  EXPECT_TRUE(axes.turns_late());
  EXPECT_EQ(axes.take_up_rad(1), 0) << "nothing is known before the entry";
  axes.follow(axes_at(0, 5), 0);
  EXPECT_NEAR(axes.take_up_rad(1), 0.2, 1e-12);
  EXPECT_NEAR(axes.take_up_rad(-1), 0.2, 1e-12);
  axes.follow(axes_at(0, 6), 0);
  EXPECT_NEAR(axes.take_up_rad(1), 0, 1e-12);
  EXPECT_NEAR(axes.take_up_rad(-1), 0.4, 1e-12);
  axes.follow(axes_at(0, 5.9), 0);
  EXPECT_NEAR(axes.take_up_rad(1), 0.1, 1e-12);
  EXPECT_NEAR(axes.take_up_rad(-1), 0.3, 1e-12);
}

TEST(AxisModel, WindUpGrowsWithTheSquareOfTheInsertedLengthFromTheEntryOn) {
  AxisModel axes({active("torsional_windup", {0.8})});
  axes.follow(axes_at(7, 0), 0);
  for (const double length_mm : {25.0, 50.0, 100.0}) {
    axes.follow(axes_at(7 + length_mm, 10), length_mm);
    EXPECT_NEAR(axes.take_up_rad(1), 0, 1e-12);
    EXPECT_NEAR(axes.take_up_rad(-1), 2 * 0.8 * std::pow(length_mm / 100, 2), 1e-12);
    axes.follow(axes_at(7 + length_mm, -10), length_mm);
    EXPECT_NEAR(axes.take_up_rad(1), 2 * 0.8 * std::pow(length_mm / 100, 2), 1e-12);
  }
}

TEST(AxisModel, EffectsThatTurnNothingLeaveTheLawAsItIs) {
  for (const auto& effects : {std::vector<model::ActiveEffect>{},
                              {active("insertion_scale", {0.9})},
                              {active("drilling", {1.5}), active("camera_scale", {1.05})},
                              {active("lost_steps", {0.8, 0, 1})}}) {
    AxisModel axes(effects);
    EXPECT_FALSE(axes.turns_late());
    axes.follow(axes_at(0, 0), 0);
    EXPECT_EQ(axes.take_up_rad(1), 0);
  }
  EXPECT_EQ(base_rate_rad_s(-1.3, 0, 1, {}), -1.3);
}

// A tip half a turn off: with the dead band undone it gets there sooner, and it does not go past.
TEST(AxisModel, UndoingTheDeadBandBringsTheTipThereSoonerAndNotTooFar) {
  constexpr double kWanted_rad = 1.0, kLayer_rad = 0.25, kRate_rad_s = 2.0, kPeriod_s = 0.02, kWidth_rad = 1.0;
  const SteeringLimits limits;
  const auto seconds_to_turn = [&](bool undo, double& farthest_rad) {
    AxisModel axes({active("rotation_backlash", {kWidth_rad})});
    double base_rad = 0, tip_rad = 0, rate = 0;
    axes.follow(axes_at(0, 0), 0);
    axes.follow(axes_at(0, base_rad = -kWidth_rad / 2 - 1e-6), 0);  // engaged the other way
    for (int i = 0; i < 500; ++i) {
      const double share = std::min(1.0, std::abs(kWanted_rad - tip_rad) / kLayer_rad);
      double wanted = std::copysign(kRate_rad_s * share, kWanted_rad - tip_rad);
      if (undo) wanted = base_rate_rad_s(wanted, axes.take_up_rad(wanted), share, limits);
      const double step = limits.rotation_acceleration_rad_s2 * kPeriod_s;
      rate = std::clamp(wanted, rate - step, rate + step);
      base_rad += rate * kPeriod_s;
      axes.follow(axes_at(0, base_rad), 0);
      tip_rad = std::max(tip_rad, base_rad - kWidth_rad / 2);  // the closed form, turning one way
      farthest_rad = std::max(farthest_rad, tip_rad);
      if (tip_rad > 0.98 * kWanted_rad) return i * kPeriod_s;
    }
    return 1e9;
  };
  double farthest_plain = 0, farthest_undone = 0;
  const double plain_s = seconds_to_turn(false, farthest_plain), undone_s = seconds_to_turn(true, farthest_undone);
  EXPECT_LT(undone_s, plain_s - 0.15);
  EXPECT_LT(farthest_undone, kWanted_rad + 0.05);
}

TEST(AxisModel, ATipThatJumpsRestsNearestBeforeOrBeyondThePoint) {
  constexpr double kJump_mm = 0.8;
  AxisModel axes({active("stick_slip", {kJump_mm})});
  EXPECT_TRUE(axes.advances_by_jumps());
  axes.follow(axes_at(0, 0), 0);
  const double base_mm = 50.3;  // the tip rests at 49.6, the next jump is due at 50.4
  axes.follow(axes_at(base_mm, 0), 49.6);
  EXPECT_EQ(axes.insertion_to_nearest_mm(0.3), 0) << "the next place is 0.5 mm beyond the point";
  // Beyond half a jump the next place is nearer; the base then stops half a jump behind the instant of that jump.
  EXPECT_NEAR(axes.insertion_to_nearest_mm(0.5), 50.4 + 0.5 * kJump_mm - base_mm, 0.05);
  EXPECT_NEAR(axes.insertion_to_nearest_mm(1.3), 51.2 + 0.5 * kJump_mm - base_mm, 0.1);
  EXPECT_EQ(axes.insertion_to_nearest_mm(60), 60) << "farther than any jump reaches";
}

TEST(AxisModel, AMembraneHoldsTheTipWhereItsOtherSideIsFartherFromThePoint) {
  AxisModel axes({active("puncture", {40, 3})});
  EXPECT_TRUE(axes.advances_by_jumps());
  axes.follow(axes_at(0, 0), 0);
  for (double base_mm = 0.5; base_mm <= 41; base_mm += 0.5)
    axes.follow(axes_at(base_mm, 0), std::min(base_mm - 0.5, 40.0));  // the depth before the step
  EXPECT_EQ(axes.insertion_to_nearest_mm(1), 0) << "through the membrane the tip is 2 mm beyond the point";
  EXPECT_NEAR(axes.insertion_to_nearest_mm(2.5), 2.2, 0.3) << "0.5 mm beyond it, once the membrane is open";
  EXPECT_NEAR(axes.insertion_to_nearest_mm(6), 5, 0.3) << "the base has to take up the millimetre that it is ahead by";
}

TEST(AxisModel, EffectsWithoutJumpsLeaveTheClosestApproachAsItIs) {
  for (const auto& effects : {std::vector<model::ActiveEffect>{},
                              {active("insertion_scale", {0.9})},
                              {active("insertion_backlash", {1.0}), active("torsional_windup", {0.6})}}) {
    AxisModel axes(effects);
    EXPECT_FALSE(axes.advances_by_jumps());
    axes.follow(axes_at(0, 0), 0);
    axes.follow(axes_at(30, 0), 30);
    EXPECT_EQ(axes.insertion_to_nearest_mm(0.3), 0.3);
  }
}

}  // namespace
}  // namespace bevel::controller
