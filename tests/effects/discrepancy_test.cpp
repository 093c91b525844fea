// SPDX-License-Identifier: MIT
// Discrepancies against motions that are made by hand, against differences, and what they and the variation between
// insertions make uncertain against draws.
#include <bevel/model/effects/discrepancy.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <numbers>
#include <random>

#include <bevel/error.hpp>
#include <bevel/model/effects/prediction_spread.hpp>
#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

using Component = DiscrepancyComponent;

DiscrepancyCurve constant(Component component, double value, Covariate covariate = Covariate::depth_mm) {
  const bool periodic = covariate == Covariate::roll_rad;
  return {component, covariate, {0}, {value}, {0}, periodic};
}

std::vector<Eigen::Vector3d> path_with(const NeedleParameters& needle, const DiscrepancyCurve& curve,
                                       const Motion& motion) {
  return path_of(needle, {active_discrepancy(curve)}, motion);
}

// As if the base had moved so.
template <class Change>
Motion changed(Motion motion, Change change) {
  double pushed_mm = 0;
  std::vector<BaseMotion> before = motion.nodes;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (i > 0) pushed_mm += std::abs(before[i].insertion_mm - before[i - 1].insertion_mm);
    change(motion.nodes[i], pushed_mm);
  }
  return motion;
}

// Over every covariate: a constant does not depend on it.
TEST(Discrepancy, AConstantIsAnEquivalentMotion) {
  const Motion motion = rich_script().recorded();
  NeedleParameters more = agar();
  more.curvature_per_mm += 8e-4;
  const auto advanced = changed(motion, [](BaseMotion& b, double) { b.insertion_mm *= 1.04; });
  const auto twisted = changed(motion, [](BaseMotion& b, double pushed_mm) { b.rotation_rad += 0.02 * pushed_mm; });
  const auto screwed = changed(motion, [](BaseMotion& b, double) { b.insertion_mm += 0.3 * b.rotation_rad; });
  const auto geared = changed(motion, [](BaseMotion& b, double) { b.rotation_rad *= 0.9; });
  // A curvature vector (k, c) is one of its length, of a bevel turned toward it.
  NeedleParameters turned = agar();
  turned.curvature_per_mm = std::hypot(agar().curvature_per_mm, 1.5e-3);
  const auto bevel = active("bevel_offset", {std::atan2(1.5e-3, agar().curvature_per_mm)});
  for (const Covariate covariate : all_covariates()) {
    if (!goes_over(Component::advance, covariate)) continue;
    const auto distance = [&](Component component, double value, const std::vector<Eigen::Vector3d>& expected) {
      return largest_distance_mm(path_with(agar(), constant(component, value, covariate), motion), expected);
    };
    EXPECT_LT(distance(Component::curvature_bevel, 8e-4, path_of(more, {}, motion)), 1e-9);
    EXPECT_LT(distance(Component::curvature_across, 1.5e-3, path_of(turned, {bevel}, motion)), 1e-9);
    EXPECT_LT(distance(Component::pull_x, 8e-4, path_of(agar(), {active("lateral_bias", {8e-4, 0})}, motion)), 1e-9);
    EXPECT_LT(distance(Component::pull_y, 8e-4, path_of(agar(), {active("lateral_bias", {0, 8e-4})}, motion)), 1e-9);
    EXPECT_LT(distance(Component::advance, 0.04, path_of(agar(), {}, advanced)), 1e-9);
    EXPECT_LT(distance(Component::advance, 0.04, path_of(agar(), {active("insertion_scale", {1.04})}, motion)), 1e-9);
    EXPECT_LT(distance(Component::turning, 0.02, path_of(agar(), {}, twisted)), 1e-9);
    EXPECT_LT(distance(Component::advance_turning, 0.3, path_of(agar(), {}, screwed)), 1e-9);
    EXPECT_LT(distance(Component::turning_turning, -0.1, path_of(agar(), {}, geared)), 1e-9);
  }
}

TEST(Discrepancy, AConstantDriftCarriesAsideByTheDepth) {
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  const Motion motion = Script{{3, 12, 0}, {0.5, -12, 0}, {2, 10, 0}}.recorded();
  const auto bevel = path_with(straight, constant(Component::drift_bevel, 0.03), motion);
  const auto across = path_with(straight, constant(Component::drift_across, 0.03), motion);
  for (std::size_t i = 0; i < motion.at.size(); ++i) {
    const double depth_mm = motion.nodes[motion.at[i]].insertion_mm;
    EXPECT_LT((bevel[i] - Eigen::Vector3d(0, -0.03 * depth_mm, depth_mm)).norm(), 1e-9);
    EXPECT_LT((across[i] - Eigen::Vector3d(0.03 * depth_mm, 0, depth_mm)).norm(), 1e-9);
  }
  // With a turn of the base the drift goes on in its new direction.
  const Motion quarter = Script{{2, 10, 0}, {1, 0, std::numbers::pi / 2}, {2, 10, 0}}.recorded();
  const auto end = path_with(straight, constant(Component::drift_bevel, 0.03), quarter).back();
  EXPECT_LT((end - Eigen::Vector3d(0.6, -0.6, 40)).norm(), 1e-2);  // the last reading is some ms before the end
}

TEST(Discrepancy, AReadingIsShifted) {
  const Motion motion = rich_script().recorded();
  const auto plain = path_of(agar(), {}, motion);
  for (int axis = 0; axis < 3; ++axis) {
    const auto component = static_cast<Component>(static_cast<int>(Component::x) + axis);
    const auto shifted = path_with(agar(), constant(component, 0.7), motion);
    for (std::size_t i = 0; i < plain.size(); ++i) {
      const double expected = motion.at[i] > 0 ? 0.7 : 0;  // from the first motion on
      EXPECT_LT((shifted[i] - plain[i] - expected * Eigen::Vector3d::Unit(axis)).norm(), 1e-12);
    }
  }
}

// Over depth the integral of a line is a parabola; over time at a constant rate the same.
TEST(Discrepancy, ACurveIsIntegrated) {
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  const Motion motion = Script{{5, 10, 0}}.fine();
  const DiscrepancyCurve over_depth{Component::advance, Covariate::depth_mm, {0, 50}, {0, 0.1}, {0, 0}};
  const DiscrepancyCurve over_time{Component::advance, Covariate::time_s, {0, 5}, {0, 0.1}, {0, 0}};
  const DiscrepancyCurve flat_outside{Component::advance, Covariate::depth_mm, {10, 20}, {0, 0.1}, {0, 0}};
  EXPECT_NEAR(path_with(straight, over_depth, motion).back().z(), 50 + 2.5, 1e-3);
  EXPECT_NEAR(path_with(straight, over_time, motion).back().z(), 50 + 2.5, 1e-3);
  EXPECT_NEAR(path_with(straight, flat_outside, motion).back().z(), 50 + 0.5 + 3, 1e-3);
  // Round the circle: the value at pi, read after half a turn either way.
  const DiscrepancyCurve over_roll{Component::x, Covariate::roll_rad, {0, std::numbers::pi}, {0.2, 0.6}, {0, 0}, true};
  for (const double turns : {-1.5, -0.5, 0.5, 2.5})
    EXPECT_NEAR(path_with(straight, over_roll, Script{{4, 10, turns * std::numbers::pi / 2}}.fine()).back().x(), 0.6,
                1e-9);
}

// A straight needle at a slope a: the tip's place along x is a share of its way, so that an advance in proportion to
// it, ds_tip = (1 + c x) ds, grows exponentially.
TEST(Discrepancy, ACurveOverTheTipsPlaceFollowsTheTip) {
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  constexpr double kSlope_rad = 0.3, kShare_per_mm = 0.02, kEnd_mm = 50;
  const Motion motion = Script{{5, kEnd_mm / 5, 0}}.fine();
  const double rate_per_mm = kShare_per_mm * std::sin(kSlope_rad);
  const double way_mm = std::expm1(rate_per_mm * kEnd_mm) / rate_per_mm;
  for (const bool along_x : {true, false}) {
    const auto entry = active("entry_angle", {along_x ? 0 : -kSlope_rad, along_x ? kSlope_rad : 0});
    const Covariate covariate = along_x ? Covariate::tip_x_mm : Covariate::tip_y_mm;
    const DiscrepancyCurve faster{
        Component::advance, covariate, {-40, 40}, {-40 * kShare_per_mm, 40 * kShare_per_mm}, {0, 0}};
    const auto path = path_of(straight, {entry, active_discrepancy(faster)}, motion);
    EXPECT_NEAR(path.back().norm(), way_mm, 2e-3 * way_mm);  // the place is that at the start of a leg
    EXPECT_NEAR(path.back()[along_x ? 0 : 1], path.back().norm() * std::sin(kSlope_rad), 1e-9);
  }
}

// The same toward any direction aside: turned with what it looks along, a curve says the same.
TEST(Discrepancy, ADirectionAsideIsAsGoodAsAnother) {
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  const Motion motion = Script{{5, 10, 0}}.fine();
  double first_mm = 0;
  for (const Covariate covariate :
       {Covariate::tip_x_mm, Covariate::tip_y_mm, Covariate::tip_xy_mm, Covariate::tip_yx_mm}) {
    const Eigen::Vector2d along = *tip_direction(covariate);
    EXPECT_NEAR(along.norm(), 1, 1e-12);
    // The heading turns toward it by 0.3 rad: about x toward -y, about y toward x.
    const auto entry = active("entry_angle", {-0.3 * along.y(), 0.3 * along.x()});
    const DiscrepancyCurve faster{Component::advance, covariate, {-40, 40}, {-0.8, 0.8}, {0, 0}};
    const Eigen::Vector3d end_mm = path_of(straight, {entry, active_discrepancy(faster)}, motion).back();
    if (first_mm == 0) first_mm = end_mm.norm();
    EXPECT_NEAR(end_mm.norm(), first_mm, 2e-3 * first_mm) << name_of(covariate);
    EXPECT_NEAR(place_along(along, end_mm), end_mm.norm() * std::sin(0.3), 0.02 * end_mm.norm());
    // Across it the tip is where nothing is off.
    const DiscrepancyCurve across{Component::x, covariate, {-40, 40}, {-40, 40}, {0, 0}};
    const auto sideways = active("entry_angle", {0.3 * along.x(), 0.3 * along.y()});
    const Eigen::Vector3d with = path_of(straight, {sideways, active_discrepancy(across)}, motion).back();
    EXPECT_NEAR((with - path_of(straight, {sideways}, motion).back()).norm(), 0, 0.2) << name_of(covariate);
  }
  for (const Covariate covariate : all_covariates())
    EXPECT_EQ(tip_direction(covariate).has_value(), name_of(covariate).starts_with("tip_"));
}

// After a change of the base's speed a reading is off by the change times the curve, and what several changes bring
// adds up: against that sum, and against an oscillator that is shaken by the base, which is integrated here.
TEST(Discrepancy, WhatChangesOfSpeedBringAddsUp) {
  NeedleParameters straight = bicycle();
  straight.curvature_per_mm = 0;
  constexpr double kNatural_rad_s = 2 * std::numbers::pi * 1.6, kDamping = 0.25, kGain_mm_per_mm_s = 0.05;
  const double decay_per_s = kDamping * kNatural_rad_s;
  const double ringing_rad_s = kNatural_rad_s * std::sqrt(1 - kDamping * kDamping);
  DiscrepancyCurve curve{Component::y, Covariate::since_speed_change_s, {}, {}, {}};
  for (std::size_t i = 1; i <= kSpeedChanges; ++i) {
    const double since_s = static_cast<double>(i) * kSpeedChange_s;
    curve.at.push_back(since_s);
    curve.values.push_back(kGain_mm_per_mm_s * std::exp(-decay_per_s * since_s) * std::sin(ringing_rad_s * since_s) *
                           kNatural_rad_s / ringing_rad_s);
    curve.std_errors.push_back(0);
  }
  // Changes of the speed, and when: within a tick of each other, from the start, back, and at rest.
  const std::vector<std::pair<double, double>> changes = {{0, 12},   {1.0, -12}, {1.3, 6},
                                                          {1.31, 2}, {3.0, -18}, {4.0, 10}};
  const Motion motion =
      Script{{1.0, 12, 0}, {0.3, 0, 1}, {0.01, 6, 0}, {1.69, 8, 0}, {1.0, -10, 0}, {1.0, 0, 0}}.fine();
  const auto linear = [&](double since_s) {  // none at once, and forgotten after the last
    const double u = since_s / kSpeedChange_s;
    const auto i = static_cast<std::size_t>(std::floor(std::max(u, 0.0)));
    const auto at = [&](std::size_t k) { return k == 0 || k > kSpeedChanges ? 0.0 : curve.values[k - 1]; };
    return u <= 0 ? 0 : at(i) + (u - static_cast<double>(i)) * (at(i + 1) - at(i));
  };
  const auto path = path_with(straight, curve, motion);
  double y_mm = 0, rate_mm_s = 0, largest_mm = 0;
  std::size_t node = 0;
  for (std::size_t r = 0; r < path.size(); ++r) {
    const double time_s = motion.nodes[motion.at[r]].time_s;
    double sum_mm = 0;
    for (const auto& [at_s, change_mm_s] : changes) sum_mm += change_mm_s * linear(time_s - at_s);
    EXPECT_NEAR(path[r].y(), sum_mm, 0.03) << time_s;  // the history has ticks of its own
    for (; node < motion.at[r]; ++node) {
      const double step_s = motion.nodes[node + 1].time_s - motion.nodes[node].time_s;
      for (const auto& [at_s, change_mm_s] : changes)
        if (std::abs(at_s - motion.nodes[node].time_s) < 0.5 * step_s)
          rate_mm_s += kGain_mm_per_mm_s * kNatural_rad_s * change_mm_s;
      rate_mm_s -= step_s * (2 * decay_per_s * rate_mm_s + kNatural_rad_s * kNatural_rad_s * y_mm);
      y_mm += step_s * rate_mm_s;
    }
    EXPECT_NEAR(path[r].y(), y_mm, 0.12) << time_s;  // which the curve follows from tenth to tenth of a second
    largest_mm = std::max(largest_mm, std::abs(y_mm));
  }
  EXPECT_GT(largest_mm, 0.6);
  // Over legs of any length: the last of three that are as long as the motion's parts.
  const AugmentedNeedle needle(straight, {active_discrepancy(curve)});
  AugmentedState state = needle.entry({});
  for (const BaseMotion& to : {BaseMotion{1, 12, 0}, BaseMotion{30, 12, 1}, BaseMotion{30.2, 14.4, 1}})
    ASSERT_TRUE(needle.advance(state, to));
  TipReading reading;
  needle.point(state, reading);
  EXPECT_NEAR(reading.position_mm.y(), 12 * linear(0.2), 1e-9);
}

// By the needle's own parameters: where the tip is moves with them, and with it what the curve says.
TEST(Discrepancy, DerivativesOfACurveOverTheTipsPlaceAreThoseOfDifferences) {
  const Motion motion = rich_script().recorded();
  for (const auto& info : discrepancy_components())
    for (const Covariate covariate : {Covariate::tip_x_mm, Covariate::tip_y_mm, Covariate::tip_xy_mm}) {
      // One slope all the way: a difference over a knot would be of two.
      const double steep = 2e-3 * info.largest;
      const std::vector<ActiveEffect> curve = {
          active_discrepancy({info.component, covariate, {-40, 40}, {-40 * steep, 40 * steep}, {0, 0}})};
      const OpenLoop path = run(AugmentedNeedle(agar(), curve, 2, {.curvature = 0, .roll = 1}), motion);
      for (const int column : {0, 1}) {
        const double step = column == 0 ? 1e-7 : 1e-6;
        const auto moved = [&](double by) {
          NeedleParameters needle = agar();
          std::vector<ActiveEffect> effects = curve;
          if (column == 0) needle.curvature_per_mm += by;
          if (column == 1) effects.push_back(active("bevel_offset", {by}));
          return path_of(needle, effects, motion);
        };
        const auto above = moved(step), below = moved(-step);
        double off = 0, size = 0;
        for (std::size_t r = 0; r < above.size(); ++r) {
          const Eigen::Vector3d difference = (above[r] - below[r]) / (2 * step);
          const auto slope = path.jacobian.block<3, 1>(static_cast<Eigen::Index>(3 * r), column);
          off = std::max(off, (difference - slope).norm());
          size = std::max(size, difference.norm());
        }
        EXPECT_LT(off, 1e-4 * size) << info.name << " over " << name_of(covariate) << ", column " << column;
      }
    }
}

// By the values of its knots, about a curve that is not zero and beside another effect.
TEST(Discrepancy, DerivativesByItsKnotsAreThoseOfDifferences) {
  const Motion motion = rich_script().recorded();
  for (const auto& info : discrepancy_components())
    for (const Covariate covariate : all_covariates()) {
      if (!goes_over(info.component, covariate)) continue;
      const bool periodic = covariate == Covariate::roll_rad;
      DiscrepancyCurve curve{info.component, covariate, {}, {}, {}, periodic};
      const double last = covariate == Covariate::depth_mm || covariate == Covariate::since_reversal_mm ? 40 : 5;
      for (int i = 0; i < 6; ++i) {
        curve.at.push_back(periodic ? 2 * std::numbers::pi * i / 6 : last * i / 5);
        curve.values.push_back(info.largest * 1e-3 * (i - 2));
        curve.std_errors.push_back(0);
      }
      const auto windup = active("torsional_windup", {0.4});
      for (std::size_t first = 0; first < 6; first += kKnotsOfPart) {
        ActiveEffect part;
        part.owned = make_discrepancy(curve, first);
        part.effect = part.owned.get();
        for (std::size_t k = 0; k < kKnotsOfPart; ++k) part.parameters[k] = Dual::unknown(0, static_cast<int>(k));
        const OpenLoop path = run(AugmentedNeedle(agar(), {windup, part}, kKnotsOfPart), motion);
        for (std::size_t k = first; k < std::min<std::size_t>(first + kKnotsOfPart, 6); ++k) {
          const double step = info.largest * 1e-4;
          DiscrepancyCurve up = curve, down = curve;
          up.values[k] += step, down.values[k] -= step;
          const auto above = path_of(agar(), {windup, active_discrepancy(up)}, motion);
          const auto below = path_of(agar(), {windup, active_discrepancy(down)}, motion);
          double off = 0, size = 0;
          for (std::size_t r = 0; r < above.size(); ++r) {
            const Eigen::Vector3d difference = (above[r] - below[r]) / (2 * step);
            const Eigen::Vector3d column =
                path.jacobian.block<3, 1>(static_cast<Eigen::Index>(3 * r), static_cast<Eigen::Index>(k - first));
            off = std::max(off, (difference - column).norm());
            size = std::max(size, difference.norm());
          }
          EXPECT_LT(off, 2e-3 * size + 1e-6) << info.name << " over " << name_of(covariate) << ", knot " << k;
        }
      }
    }
}

// A filter keeps the values of an effect's memory and no more; at each leg it takes the insertion up again.
TEST(Discrepancy, IsTakenUpFromTheValuesOfItsMemory) {
  const Motion motion = rich_script().recorded();
  for (const auto& info : discrepancy_components())
    for (const Covariate covariate : all_covariates()) {
      if (!goes_over(info.component, covariate)) continue;
      const bool periodic = covariate == Covariate::roll_rad;
      const std::vector<double> at = periodic ? std::vector<double>{0, std::numbers::pi} : std::vector<double>{0, 3};
      const AugmentedNeedle needle(
          agar(), {active_discrepancy({info.component, covariate, at, {0, 0.1 * info.largest}, {0, 0}, periodic})});
      AugmentedState whole = needle.entry(motion.nodes.front()), kept = whole;
      TipReading a, b;
      for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
        ASSERT_TRUE(needle.advance(whole, motion.nodes[i]) && needle.advance(kept, motion.nodes[i]));
        for (auto& slot : kept.memory[0].slot) slot = Dual(slot.value);
        needle.point(whole, a);
        needle.point(kept, b);
        ASSERT_EQ(a.position_mm, b.position_mm) << info.name << " over " << name_of(covariate);
      }
    }
}

TEST(Discrepancy, FaultsAreNamed) {
  DiscrepancyCurve curve = constant(Component::x, 0.1);
  EXPECT_EQ(find_fault(curve), "");
  curve.values = {std::numeric_limits<double>::quiet_NaN()};
  EXPECT_THAT(find_fault(curve), ::testing::HasSubstr("values: element 0 = nan is not allowed"));
  EXPECT_THROW(make_discrepancy(curve), bevel::ArgumentError);
  curve = {Component::x, Covariate::depth_mm, {}, {}, {}};
  EXPECT_THAT(find_fault(curve), ::testing::HasSubstr("knots has 0 elements"));
  const DiscrepancyCurve of_motion{Component::advance, Covariate::since_speed_change_s, {0.1}, {0}, {0}};
  EXPECT_THAT(find_fault(of_motion), ::testing::HasSubstr("covariate is since_speed_change_s, but the component is "
                                                          "advance; allowed: x, y, z with it"));
}

// Draws of an insertion's own values, each propagated on its own.
TEST(PredictionSpread, OfTheVariationIsThatOfDraws) {
  constexpr int kDraws = 3000;
  const Motion motion = Script{{3, 12, 0.4}, {0.5, 0, 4}, {3, 12, 0}}.recorded();
  const Variation variation{
      .curvature_relative = 0.08, .entry_angle_rad = 0.01, .entry_point_mm = 0.3, .roll_rad = 0.06};
  const std::vector<ActiveEffect> effects = {active("torsional_windup", {0.3}), active("camera_scale", {1.1})};
  const auto expected = reading_covariances(agar(), effects, {}, variation, motion);
  const auto centre = path_of(agar(), effects, motion);
  std::vector<Eigen::Matrix3d> drawn(motion.at.size(), Eigen::Matrix3d::Zero());
  for (int d = 0; d < kDraws; ++d) {
    const OwnValues own = draw(variation, 1000 + static_cast<std::uint64_t>(d));
    const AugmentedNeedle needle(of_insertion(agar(), own), effects);
    AugmentedState state = needle.entry(motion.nodes.front());
    state.pose = of_insertion(state.pose, own);
    TipReading reading;
    std::size_t node = 0;
    for (std::size_t r = 0; r < motion.at.size(); ++r) {
      for (; node < motion.at[r]; ++node) ASSERT_TRUE(needle.advance(state, motion.nodes[node + 1]));
      needle.point(state, reading);
      needle.through_cameras(reading);
      const Eigen::Vector3d off = reading.position_mm - centre[r];
      drawn[r] += off * off.transpose() / kDraws;
    }
  }
  double least = 10, most = 0;
  for (std::size_t r = 0; r < drawn.size(); ++r)
    for (int axis = 0; axis < 2; ++axis) {
      const double ratio = std::sqrt(drawn[r](axis, axis) / expected[r](axis, axis));
      least = std::min(least, ratio), most = std::max(most, ratio);
    }
  const Eigen::Vector3d end = expected.back().diagonal().cwiseSqrt();
  std::cout << "sd at 72 mm " << end.transpose() << " mm; drawn over linearised " << least << " to " << most << "\n";
  // 3000 draws: 1.3 % one standard deviation. Along the needle the spread is of second order.
  EXPECT_GT(least, 0.94);
  EXPECT_LT(most, 1.06);
  EXPECT_LT(std::sqrt(drawn.back()(2, 2)), 2 * std::sqrt(expected.back()(2, 2)) + 0.05);
}

TEST(PredictionSpread, OfACurvesErrorsIsThatOfDraws) {
  constexpr int kDraws = 2000;
  const Motion motion = Script{{3, 12, 0.4}, {0.5, 0, 4}, {3, 12, 0}}.recorded();
  DiscrepancyCurve bend{Component::curvature_bevel, Covariate::depth_mm, {}, {}, {}};
  for (int i = 0; i < 8; ++i) {
    bend.at.push_back(10.0 * i);
    bend.values.push_back(1e-4 * i);
    bend.std_errors.push_back(2e-4 + 2e-5 * i);
  }
  DiscrepancyCurve pull = bend;
  pull.component = Component::pull_y;
  const DiscrepancyCurve shift{Component::x, Covariate::time_s, {0, 6}, {0, 0.5}, {0.05, 0.2}};
  const std::vector<DiscrepancyCurve> curves = {bend, pull, shift};
  const auto expected = reading_covariances(agar(), {}, curves, {}, motion);
  std::vector<ActiveEffect> middle;
  for (const DiscrepancyCurve& curve : curves) middle.push_back(active_discrepancy(curve));
  const auto centre = path_of(agar(), middle, motion);
  std::vector<Eigen::Vector3d> drawn(motion.at.size(), Eigen::Vector3d::Zero());
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (int d = 0; d < kDraws; ++d) {
    std::vector<ActiveEffect> active;
    for (DiscrepancyCurve curve : curves) {
      for (std::size_t i = 0; i < curve.at.size(); ++i) curve.values[i] += curve.std_errors[i] * normal(random);
      active.push_back(active_discrepancy(curve));
    }
    const auto path = path_of(agar(), active, motion);
    for (std::size_t r = 0; r < path.size(); ++r) drawn[r] += (path[r] - centre[r]).cwiseAbs2() / kDraws;
  }
  double least = 10, most = 0;
  for (std::size_t r = 10; r < drawn.size(); ++r)  // from a depth on at which there is something to compare
    for (int axis = 0; axis < 2; ++axis) {
      const double ratio = std::sqrt(drawn[r][axis] / expected[r](axis, axis));
      least = std::min(least, ratio), most = std::max(most, ratio);
    }
  std::cout << "sd at 72 mm " << expected.back().diagonal().cwiseSqrt().transpose() << " mm; drawn over linearised "
            << least << " to " << most << "\n";
  EXPECT_GT(least, 0.93);
  EXPECT_LT(most, 1.07);
}

}  // namespace
}  // namespace bevel::model::testing
