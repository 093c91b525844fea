// SPDX-License-Identifier: MIT
// Effects between the base's axes and the tip's, against gap variables by brute force and closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "tests/effects/brute_force.hpp"

namespace bevel::model::testing {
namespace {

// Base and tip joined by a gap that is open by `half_width(inserted)` to either side: the tip is carried where it is
// shut. Written with the gap's state, not with the product's play operator.
auto gap(const std::function<double(double)>& half_width, bool rotation) {
  return [half_width, rotation, open = 0.0, base = 0.0](const Instant& now, double& s_mm, double& r_rad) mutable {
    double& axis = rotation ? r_rad : s_mm;
    open += axis - base;
    base = axis;
    const double limit = half_width(now.base.insertion_mm);
    open = std::clamp(open, -limit, limit);
    axis = base - open;
  };
}

AugmentedState end_of(const AugmentedNeedle& needle, const Motion& motion) {
  AugmentedState state = needle.entry(motion.nodes.front());
  for (std::size_t i = 1; i < motion.nodes.size(); ++i) EXPECT_TRUE(needle.advance(state, motion.nodes[i]));
  return state;
}

TEST(RotationBacklash, IsAGapBetweenBaseAndTip) {
  const Script script = rich_script();
  BruteForce brute{.needle = agar(), .axes = gap([](double) { return 0.2; }, true)};
  const auto effect = active("rotation_backlash", {0.4});
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, script.fine()), brute.path(script, script.fine())), 2e-4);
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, script.recorded()), brute.path(script, script.recorded())),
            5e-3);
}

TEST(RotationBacklash, TipLagsByHalfTheWidthEachWay) {
  const AugmentedNeedle needle(agar(), {active("rotation_backlash", {0.4})});
  EXPECT_NEAR(end_of(needle, Script{{1, 0, 1.5}}.fine()).tip_rotation_rad.value, 1.3, 1e-12);
  EXPECT_NEAR(end_of(needle, Script{{1, 0, 1.5}, {1, 0, -0.3}}.fine()).tip_rotation_rad.value, 1.3, 1e-12);
  EXPECT_NEAR(end_of(needle, Script{{1, 0, 1.5}, {1, 0, -1.5}}.fine()).tip_rotation_rad.value, 0.2, 1e-12);
}

TEST(RotationBacklash, TipNeverLagsByMoreThanHalfTheWidthAndNeverRunsAhead) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> widths_rad(0, 2), turns_rad(-2, 2);
  for (int trial = 0; trial < 200; ++trial) {
    const double width_rad = trial == 0 ? 0 : widths_rad(random);
    const AugmentedNeedle needle(bicycle(), {active("rotation_backlash", {width_rad})});
    BaseMotion base;
    AugmentedState state = needle.entry(base);
    for (int leg = 0; leg < 50; ++leg) {
      const double before_rad = state.tip_rotation_rad.value;
      const double turn_rad = turns_rad(random);
      base.time_s += 0.1;
      base.rotation_rad += turn_rad;
      ASSERT_TRUE(needle.advance(state, base));
      const double tip_rad = state.tip_rotation_rad.value;
      ASSERT_LE(std::abs(base.rotation_rad - tip_rad), 0.5 * width_rad + 1e-12);
      ASSERT_GE((tip_rad - before_rad) * turn_rad, 0);
    }
  }
}

TEST(TorsionalWindup, IsAGapThatGrowsWithTheInsertedLength) {
  const Script script = rich_script();
  const auto half_width = [](double inserted_mm) { return 0.6 * inserted_mm * inserted_mm / 1e4; };
  BruteForce brute{.needle = agar(), .axes = gap(half_width, true)};
  const auto effect = active("torsional_windup", {0.6});
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, script.fine()), brute.path(script, script.fine())), 2e-4);
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, script.recorded()), brute.path(script, script.recorded())),
            0.02);
}

TEST(TorsionalWindup, LagAtADepthIsItsSquareLaw) {
  const AugmentedNeedle needle(agar(), {active("torsional_windup", {0.6})});
  for (const double depth_mm : {20.0, 50.0, 80.0}) {
    const double lag = 0.6 * depth_mm * depth_mm / 1e4;
    EXPECT_NEAR(end_of(needle, Script{{1, depth_mm, 0}, {1, 0, 2}}.fine()).tip_rotation_rad.value, 2 - lag, 1e-12);
    EXPECT_NEAR(end_of(needle, Script{{1, depth_mm, 0}, {1, 0, 2}, {1, 0, -2}}.fine()).tip_rotation_rad.value, lag,
                1e-12);
  }
}

TEST(InsertionBacklash, IsAGapBetweenBaseAndTip) {
  const Script script = rich_script();
  BruteForce brute{.needle = agar(), .axes = gap([](double) { return 0.6; }, false)};
  const auto effect = active("insertion_backlash", {1.2});
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, script.fine()), brute.path(script, script.fine())), 2e-3);
  const AugmentedNeedle needle(agar(), {effect});
  EXPECT_NEAR(end_of(needle, Script{{1, 30, 0}}.fine()).tip_insertion_mm.value, 29.4, 1e-12);
  EXPECT_NEAR(end_of(needle, Script{{1, 30, 0}, {1, -10, 0}}.fine()).tip_insertion_mm.value, 20.6, 1e-12);
}

TEST(InsertionScale, ShortensTheArc) {
  const double k = bicycle().curvature_per_mm;
  const auto path = path_of(bicycle(), {active("insertion_scale", {0.9})}, Script{{5, 20, 0}}.recorded());
  const Motion motion = Script{{5, 20, 0}}.recorded();
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double arc = 0.9 * motion.nodes[motion.at[i]].insertion_mm;
    EXPECT_NEAR(path[i].y(), -(1 - std::cos(k * arc)) / k, 1e-9);
    EXPECT_NEAR(path[i].z(), std::sin(k * arc) / k, 1e-9);
  }
}

TEST(InsertionScale, CountsFromTheEntryOfThisRecording) {
  Motion motion = Script{{3, 20, 0.5}}.recorded();
  const auto expected = path_of(agar(), {active("insertion_scale", {0.9})}, motion);
  for (auto& node : motion.nodes) node.insertion_mm += 40;  // the drive's own zero is elsewhere
  EXPECT_LT(largest_distance_mm(path_of(agar(), {active("insertion_scale", {0.9})}, motion), expected), 1e-9);
}

TEST(LostSteps, AreAJumpOfTheTrueAxis) {
  const Script script = rich_script();
  const Motion motion = script.fine();
  const double at_s = 4.3;
  for (const bool rotation : {true, false}) {
    const auto effect = active("lost_steps", {rotation ? 0.8 : 0, rotation ? 0 : -2.5, at_s});
    BruteForce brute{.needle = agar(), .axes = [&](const Instant& now, double& s_mm, double& r_rad) {
                       // The product's stalls: a fiftieth of a second for an insertion, a tenth for a rotation.
                       const double stall_s = rotation ? 0.1 : 0.02;
                       const double share = std::clamp((now.time_s - at_s) / stall_s + 0.5, 0.0, 1.0);
                       (rotation ? r_rad : s_mm) += share * (rotation ? 0.8 : -2.5);
                     }};
    const auto path = path_of(agar(), {effect}, motion);
    EXPECT_LT(largest_distance_mm(path, brute.path(script, motion)), 2e-3);
    const auto without = path_of(agar(), {}, motion);
    double after_mm = 0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const double distance_mm = (path[i] - without[i]).norm();
      const bool before = motion.nodes[motion.at[i]].time_s < at_s - 0.05;
      EXPECT_TRUE(!before || distance_mm == 0) << distance_mm;
      after_mm = std::max(after_mm, distance_mm);
    }
    EXPECT_GT(after_mm, 0.3);
  }
}

TEST(LostSteps, AreNotInARecordingWithoutTheirInstant) {
  const Motion motion = rich_script().recorded();
  EXPECT_EQ(path_of(agar(), {active("lost_steps", {0.8, 3, 0})}, motion), path_of(agar(), {}, motion));
}

TEST(Puncture, StallsAtTheMembraneAndCatchesUp) {
  const Script script = rich_script();
  constexpr double kDepth_mm = 22;
  constexpr double kIndentation_mm = 2.5;
  // Pushed against the membrane the needle stores length; it breaks a little before 2.5 mm, by nearly half of the
  // 0.4 mm of the base within which all of it is given back.
  constexpr double kBreaks_mm = kIndentation_mm * kIndentation_mm / (kIndentation_mm + 0.2);
  static_assert(kBreaks_mm > kIndentation_mm - 0.2 && kBreaks_mm < kIndentation_mm - 0.18);
  struct Membrane {
    bool broken = false;
    bool touching = false;
    double touched_mm = 0;
  };
  const auto membrane = std::make_shared<Membrane>();
  BruteForce brute{.needle = agar(), .axes = [membrane](const Instant& now, double& s_mm, double&) {
                     if (membrane->broken) return;
                     if (!membrane->touching && now.p_mm.z() >= kDepth_mm) {
                       membrane->touching = true;
                       membrane->touched_mm = now.s_mm;
                     }
                     if (!membrane->touching) return;
                     const double pushed_mm = s_mm - membrane->touched_mm;
                     if (pushed_mm > kBreaks_mm + 0.4) membrane->broken = true;
                     if (pushed_mm < 0) membrane->touching = false;
                     if (pushed_mm >= 0 && pushed_mm <= kBreaks_mm) s_mm = membrane->touched_mm;
                     if (pushed_mm > kBreaks_mm && pushed_mm < kBreaks_mm + 0.4)
                       s_mm = membrane->touched_mm + (pushed_mm - kBreaks_mm) / 0.4 * (kBreaks_mm + 0.4);
                   }};
  const auto effect = active("puncture", {kDepth_mm, kIndentation_mm});
  EXPECT_LT(largest_distance_mm(path_of(agar(), {effect}, script.fine()), brute.path(script, script.fine())), 5e-3);
  ASSERT_TRUE(membrane->broken);

  // Straight in: z is the ramp, the stall and the jump.
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  const Motion motion = Script{{4, 10, 0}}.recorded();
  const auto path = path_of(straight, {effect}, motion);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double base_mm = motion.nodes[motion.at[i]].insertion_mm;
    const double pushed_mm = base_mm - kDepth_mm;
    const bool held = pushed_mm > 0 && pushed_mm < kBreaks_mm;
    const bool catching_up = pushed_mm >= kBreaks_mm && pushed_mm <= kBreaks_mm + 0.4;
    if (!catching_up) {
      EXPECT_NEAR(path[i].z(), held ? kDepth_mm : base_mm, 1e-9);
    }
  }

  // Meanwhile it may be at either end of its way, the likelier through the more of it is done.
  const AugmentedNeedle needle(straight, {effect});
  int on_the_way = 0;
  AugmentedState state = needle.entry({});
  for (int i = 1; i < 3000; ++i) {
    const double base_mm = 0.01 * i;
    ASSERT_TRUE(needle.advance(state, {base_mm / 10, base_mm, 0}));
    const double share = (base_mm - kDepth_mm - kBreaks_mm) / 0.4;
    const double sd_mm = share > 0 && share < 1 ? std::sqrt(share * (1 - share)) * (kBreaks_mm + 0.4) : 0;
    on_the_way += sd_mm > 0 ? 1 : 0;
    EXPECT_NEAR(std::sqrt(needle.blur_mm2(state)[2]), sd_mm, 1e-5) << base_mm;
    EXPECT_NEAR(needle.blur_mm2(state)[0], 0, 1e-12);
  }
  EXPECT_GE(on_the_way, 39);
}

TEST(Puncture, ReleasesANeedleThatIsDrawnBackBeforeItBreaks) {
  const AugmentedNeedle needle(agar(), {active("puncture", {15, 3})});
  const auto held = end_of(needle, Script{{1, 17, 0}}.fine());
  EXPECT_NEAR(held.pose.p_mm.z(), 15, 0.01);
  const auto back = end_of(needle, Script{{1, 17, 0}, {1, -7, 0}}.fine());
  EXPECT_NEAR(back.tip_insertion_mm.value, 10, 1e-9);
  const auto again = end_of(needle, Script{{1, 17, 0}, {1, -7, 0}, {1, 7, 0}}.fine());
  EXPECT_NEAR(again.pose.p_mm.z(), held.pose.p_mm.z(), 1e-4);
}

// Stored advance and a threshold, step by step; the product counts jumps over a leg.
TEST(StickSlip, IsAThresholdOnTheStoredAdvance) {
  constexpr double kJump_mm = 1.37;
  const Script script = rich_script();
  double held_mm = 0;
  BruteForce brute{.needle = agar(), .axes = [&](const Instant&, double& s_mm, double&) {
                     if (std::abs(s_mm - held_mm) >= kJump_mm) held_mm = s_mm;
                     s_mm = held_mm;
                   }};
  const auto effect = active("stick_slip", {kJump_mm});
  for (const Motion& motion : {script.fine(), script.recorded()}) {
    held_mm = 0;
    const auto path = path_of(agar(), {effect}, motion);
    const auto expected = brute.path(script, motion);
    std::size_t in_a_jump = 0;
    for (std::size_t i = 0; i < path.size(); ++i) in_a_jump += (path[i] - expected[i]).norm() > 0.05;
    EXPECT_LE(in_a_jump, path.size() / 50);  // a jump of the product takes 0.02 mm
  }
}

TEST(StickSlip, IsASawtoothOfItsJumpOnTheWayIn) {
  const AugmentedNeedle needle(agar(), {active("stick_slip", {1.5})});
  for (const double base_mm : {0.7, 1.45, 1.55, 7.4, 7.6, 40.0})
    EXPECT_NEAR(end_of(needle, Script{{1, base_mm, 0}}.fine()).tip_insertion_mm.value, 1.5 * std::floor(base_mm / 1.5),
                1e-9)
        << base_mm;
  // Half way through a jump, which takes 0.02 mm.
  EXPECT_NEAR(end_of(needle, Script{{1, 7.5, 0}}.fine()).tip_insertion_mm.value, 6.75, 1e-6);
}

// Drawn back, it has to store up a jump the other way, from where it is held.
TEST(StickSlip, HoldsTheOtherWayToo) {
  const AugmentedNeedle needle(agar(), {active("stick_slip", {2})});
  const auto tip_at = [&](double back_mm) {
    return end_of(needle, Script{{1, 11, 0}, {1, -back_mm, 0}}.fine()).tip_insertion_mm.value;
  };
  EXPECT_NEAR(tip_at(0.5), 10, 1e-9);
  EXPECT_NEAR(tip_at(2.9), 10, 1e-9);  // the base at 8.1
  EXPECT_NEAR(tip_at(3.1), 8, 1e-9);
  EXPECT_NEAR(tip_at(7.5), 4, 1e-9);
}

TEST(StickSlip, LegsMayHoldSeveralJumpsOrAPartOfOne) {
  for (const double jump_mm : {0.013, 0.11, 0.3, 2.4}) {
    const AugmentedNeedle needle(agar(), {active("stick_slip", {jump_mm})});
    for (const double insertion_mm : {5.03, 17.77}) {
      const Script script{{1, insertion_mm, 0}, {1, -0.4 * insertion_mm, 0}};
      EXPECT_NEAR(end_of(needle, script.fine()).tip_insertion_mm.value,
                  end_of(needle, script.fine(0.05)).tip_insertion_mm.value, 1e-9)
          << jump_mm;
    }
  }
}

}  // namespace
}  // namespace bevel::model::testing
