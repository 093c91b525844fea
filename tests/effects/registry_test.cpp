// SPDX-License-Identifier: MIT
// What holds for every effect of the registry: none at its `none`, right sensitivities, an order of its own.
#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <set>

#include <bevel/error.hpp>
#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

// Sizes at which an effect shows along rich_script(), away from the corners of its law.
std::vector<double> shown(const Effect& effect) {
  static const std::map<std::string_view, std::vector<double>> sizes{{"slip_direction", {}},
                                                                     {"entry_angle", {0.05, -0.03}},
                                                                     {"bevel_offset", {0.35}},
                                                                     {"lost_steps", {0.8, -1.3, 3.327}},
                                                                     {"rotation_backlash", {0.37}},
                                                                     {"torsional_windup", {0.83}},
                                                                     {"insertion_backlash", {1.13}},
                                                                     {"insertion_scale", {0.93}},
                                                                     {"puncture", {11.3, 2.3}},
                                                                     {"stick_slip", {1.37}},
                                                                     {"flip_transient", {6.3}},
                                                                     {"rate_dependence", {0.21}},
                                                                     {"layer", {30.3, 0.7}},
                                                                     {"depth_dependence", {0.5}},
                                                                     {"drilling", {1.7}},
                                                                     {"lateral_bias", {0.0007, -0.0011}},
                                                                     {"relaxation", {1.1, 2.2, 4.3}},
                                                                     {"tissue_motion", {1.2, 0.27, 0.9, 2.0}},
                                                                     {"camera_rotation", {0.03, -0.02}},
                                                                     {"entry_point", {0.7, -0.4}},
                                                                     {"cutting_angle", {0.04}},
                                                                     {"tip_swing", {0.7, 4.3, 17, 3}},
                                                                     {"sensor_tilt", {0.03, -0.05}},
                                                                     {"camera_scale", {1.03}},
                                                                     {"refraction", {0.03, 25}},
                                                                     {"camera_latency", {0.1117}}};
  return sizes.at(effect.name());
}

// What is measured along a path: positions, and headings by a lever of 30 mm, so that all are in mm.
constexpr double kLever_mm = 30;
std::vector<Eigen::Vector3d> measured(const AugmentedNeedle& needle, const Motion& motion) {
  const OpenLoop path = run(needle, motion, true);
  std::vector<Eigen::Vector3d> all = path.position_mm;
  for (const Eigen::Vector3d& heading : path.heading) all.emplace_back(kLever_mm * heading);
  return all;
}
std::vector<Eigen::Vector3d> measured(const std::vector<ActiveEffect>& effects, const Motion& motion) {
  return measured(AugmentedNeedle(agar(), effects), motion);
}

std::vector<double> at_none(const Effect& effect) {
  std::vector<double> values = shown(effect);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const double none = effect.parameters()[i].none; !std::isnan(none)) values[i] = none;
  return values;
}

ActiveEffect active(const Effect& effect, const std::vector<double>& values, int& column) {
  ActiveEffect one = testing::active(effect.name(), values);
  for (std::size_t i = 0; i < values.size(); ++i) one.parameters[i] = Dual::unknown(values[i], column++);
  return one;
}

class EveryEffect : public ::testing::TestWithParam<const Effect*> {};
INSTANTIATE_TEST_SUITE_P(Effects, EveryEffect, ::testing::ValuesIn(all_effects().begin(), all_effects().end()),
                         [](const auto& of) { return std::string(of.param->name()); });

TEST_P(EveryEffect, ShowsAtItsSizes) {
  const Motion motion = rich_script().recorded();
  EXPECT_EQ(find_parameter_violation(*GetParam(), shown(*GetParam())), -1);
  EXPECT_GT(largest_distance_mm(measured({testing::active(GetParam()->name(), shown(*GetParam()))}, motion),
                                measured({}, motion)),
            0.05);
}

// Bit for bit, with two exceptions that come to the same by another way: a flip transient of no length turns (k, 0)
// into the roll frame and back, and a membrane without indentation gives back the base's place as touched + pushed.
// slip_direction has no size at which it vanishes: it is there or not.
TEST_P(EveryEffect, ChangesNothingAtItsNone) {
  const Effect& effect = *GetParam();
  if (effect.parameters().empty()) GTEST_SKIP() << effect.name() << " has no parameter";
  const Motion motion = rich_script().recorded();
  const auto path = measured({testing::active(effect.name(), at_none(effect))}, motion);
  const auto nominal = measured({}, motion);
  static const std::set<std::string_view> to_rounding{"flip_transient", "puncture"};
  if (to_rounding.contains(effect.name())) {
    EXPECT_LT(largest_distance_mm(path, nominal), 1e-12 * 62);
  } else {
    EXPECT_EQ(path, nominal);
  }
}

// An effect with those of its parameters that one of its kinds has; the others are as if unsaid.
struct Kind {
  const Effect* effect;
  std::uint32_t parameters;
  std::vector<double> values() const {
    std::vector<double> out = shown(*effect);
    for (std::size_t i = 0; i < out.size(); ++i)
      if (!has(i)) out[i] = value_if_unsaid(effect->parameters()[i]);
    return out;
  }
  bool has(std::size_t parameter) const { return (parameters >> parameter & 1U) != 0; }
};
std::vector<Kind> kinds_of(const Effect& effect) {
  std::vector<Kind> out;
  for (const std::uint32_t variant : effect.variants()) out.push_back({&effect, variant});
  return out;
}

// The Jacobian of model::predict against central differences of it, for k, lambda1, lambda2, ell and all parameters of
// the kinds.
void expect_sensitivities(const std::vector<Kind>& kinds, double tolerance) {
  const Motion motion = rich_script().recorded();
  constexpr int kNeedleColumns = 4;
  std::vector<double> values{agar().curvature_per_mm, agar().lambda1_per_rad, agar().lambda2, agar().wheelbase_mm};
  std::vector<bool> shows(kNeedleColumns, true);
  // By the latency a path with jumps has the mean over a leg (open_loop.hpp).
  const bool jumps = std::ranges::any_of(kinds, [](const Kind& kind) { return kind.effect->sudden(); });
  for (const Kind& kind : kinds) {
    const bool is_mean = jumps && kind.effect->name() == "camera_latency";
    for (std::size_t i = 0; const double v : kind.values())
      values.push_back(v), shows.push_back(kind.has(i++) && !is_mean);
  }
  const auto needle_at = [&](const std::vector<double>& at, int columns) {
    NeedleParameters needle = agar();
    needle.curvature_per_mm = at[0];
    needle.lambda1_per_rad = at[1];
    needle.lambda2 = at[2];
    needle.wheelbase_mm = at[3];
    std::vector<ActiveEffect> all;
    int column = kNeedleColumns;
    for (const Kind& kind : kinds) {
      const auto first = at.begin() + column;
      const std::vector<double> own(first, first + static_cast<std::ptrdiff_t>(kind.effect->parameters().size()));
      all.push_back(active(*kind.effect, own, column));
    }
    if (columns == 0)
      for (auto& one : all)
        for (auto& p : one.parameters) p = Dual(p.value);
    return AugmentedNeedle(needle, all, columns, {0, 1, 2, 3});
  };
  const OpenLoop path = run(needle_at(values, static_cast<int>(values.size())), motion, true);
  Eigen::MatrixXd jacobian(path.jacobian.rows() + path.heading_jacobian.rows(), path.jacobian.cols());
  jacobian << path.jacobian, kLever_mm * path.heading_jacobian;
  for (std::size_t c = 0; c < values.size(); ++c) {
    if (!shows[c]) continue;
    const double h = 1e-6 * std::max(std::abs(values[c]), 1e-2);
    std::vector<double> up = values, down = values;
    up[c] += h;
    down[c] -= h;
    const auto a = measured(needle_at(up, 0), motion);
    const auto b = measured(needle_at(down, 0), motion);
    Eigen::VectorXd differences(3 * a.size());
    for (std::size_t i = 0; i < a.size(); ++i)
      differences.segment<3>(static_cast<Eigen::Index>(3 * i)) = (a[i] - b[i]) / (2 * h);
    const auto column = jacobian.col(static_cast<Eigen::Index>(c));
    std::string who;
    for (const Kind& kind : kinds) who += std::string(kind.effect->name()) + " ";
    EXPECT_LT((column - differences).cwiseAbs().maxCoeff(), tolerance * differences.cwiseAbs().maxCoeff())
        << who << "column " << c;
    EXPECT_GT(differences.cwiseAbs().maxCoeff(), 0) << who << "column " << c;
  }
}

TEST_P(EveryEffect, HasTheSensitivitiesOfFiniteDifferences) {
  for (const Kind& kind : kinds_of(*GetParam())) expect_sensitivities({kind}, 2e-6);
}

TEST_P(EveryEffect, HasThemBesideEveryOther) {
  for (const Effect* other : all_effects())
    if (other != GetParam() && other->parameters().size() + GetParam()->parameters().size() + 4 <= kMaxColumns)
      expect_sensitivities({kinds_of(*GetParam()).front(), kinds_of(*other).front()}, 2e-5);
}

TEST_P(EveryEffect, DoesNotMindWhereItIsListed) {
  const Motion motion = rich_script().recorded();
  const auto one = testing::active(GetParam()->name(), shown(*GetParam()));
  for (const Effect* other : all_effects()) {
    const auto two = testing::active(other->name(), shown(*other));
    EXPECT_EQ(measured({one, two}, motion), measured({two, one}, motion)) << other->name();
  }
}

// Sensitivities come along: they may not change the path.
TEST_P(EveryEffect, HasTheSamePathWithAndWithoutColumns) {
  const Motion motion = rich_script().recorded();
  int column = 0;
  const auto with = active(*GetParam(), shown(*GetParam()), column);
  const auto without = testing::active(GetParam()->name(), shown(*GetParam()));
  EXPECT_LT(largest_distance_mm(measured(AugmentedNeedle(agar(), {with}, column), motion), measured({without}, motion)),
            1e-9);
}

TEST_P(EveryEffect, SaysWhatAReportNeeds) {
  const Effect& effect = *GetParam();
  EXPECT_EQ(find_effect(effect.name()), &effect);
  EXPECT_FALSE(effect.meaning().empty());
  EXPECT_LE(effect.parameters().size(), static_cast<std::size_t>(kMaxEffectParameters));
  for (const auto& p : effect.parameters()) {
    EXPECT_LT(p.lower, p.upper) << p.name;
    EXPECT_FALSE(p.starts.empty()) << p.name;
    for (const double start : p.starts) EXPECT_TRUE(start >= p.lower && start <= p.upper) << p.name << ' ' << start;
    EXPECT_TRUE(std::isnan(p.none) || (p.none >= p.lower && p.none <= p.upper)) << p.name;
    if (p.scope == Scope::recording || p.periodic) continue;
    // The prior density of a diagnosis: about `none` by `reported`, else over the likely range.
    if (std::isnan(p.none)) {
      EXPECT_TRUE(p.lower <= p.likely_low && p.likely_low < p.likely_high && p.likely_high <= p.upper) << p.name;
    } else {
      EXPECT_GT(p.reported, 0) << p.name;
    }
  }
}

// The readings of rich_script() with an effect at these values, and when each was taken.
struct Shown {
  std::vector<Eigen::Vector3d> path, nominal;
  std::vector<double> time_s;
};
Shown shown_at(const Effect& effect, const std::vector<double>& values) {
  const Motion motion = rich_script().recorded();
  Shown out{path_of(agar(), {testing::active(effect.name(), values)}, motion), path_of(agar(), {}, motion), {}};
  for (const std::size_t node : motion.at) out.time_s.push_back(motion.nodes[node].time_s);
  return out;
}

// A parameter that says where its effect begins: up to there it changes nothing, and from soon after it does.
TEST_P(EveryEffect, BeginsWhereItSays) {
  const Effect& effect = *GetParam();
  const auto values = shown(effect);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto begins = effect.parameters()[i].begins;
    if (begins == Begins::unsaid) continue;
    // A stall takes a moment about its instant; a tip within a leg of the depth may have reached it.
    const double early = begins == Begins::instant ? 0.1 : 1.0, late = begins == Begins::instant ? 1.0 : 10.0;
    const Shown at = shown_at(effect, values);
    double before_mm = 0, after_mm = 0, deepest_mm = 0;
    for (std::size_t r = 0; r < at.path.size(); ++r) {
      deepest_mm = std::max(deepest_mm, at.nominal[r].z());
      const double place = begins == Begins::instant ? at.time_s[r] : deepest_mm;
      const double off_mm = (at.path[r] - at.nominal[r]).norm();
      if (place < values[i] - early) before_mm = std::max(before_mm, off_mm);
      if (place > values[i] && place < values[i] + late) after_mm = std::max(after_mm, off_mm);
    }
    EXPECT_LT(before_mm, 1e-9) << effect.parameters()[i].name;
    EXPECT_GT(after_mm, 0.02) << effect.parameters()[i].name;
  }
}

// Values that are said to be the same are: a period apart, whichever way it is declared.
TEST_P(EveryEffect, ReadsTheSameAPeriodOn) {
  const Effect& effect = *GetParam();
  for (std::size_t i = 0; i < effect.parameters().size(); ++i) {
    const auto& p = effect.parameters()[i];
    if (!p.periodic && p.modulo == 0) continue;
    EXPECT_FALSE(p.periodic && p.modulo != 0) << p.name;
    auto values = shown(effect);
    if (effect.name() == "lost_steps") values = {0.8, 0, 2.3};  // while nothing is inserted
    for (const double turns : {-1.0, 1.0}) {
      auto moved = values;
      moved[i] += turns * (p.periodic ? p.upper - p.lower : p.modulo);
      // Half a turn of an angle of period pi is undone by one that goes with it.
      if (p.half_turns >= 0) moved[static_cast<std::size_t>(p.half_turns)] += std::numbers::pi;
      EXPECT_LT(largest_distance_mm(shown_at(effect, values).path, shown_at(effect, moved).path), 1e-9) << p.name;
    }
  }
}

// A shaft that loses a turn takes a moment to do so. What it cuts in that moment goes another way: 2 mm at 20 mm/s,
// which leave the heading at most 4 mm of curvature apart. Quick insertions tell turns apart, if only by that.
TEST(LostSteps, ATurnMoreShowsByWhatIsCutMeanwhile) {
  const Effect& effect = *find_effect("lost_steps");
  const double turn = effect.parameters()[0].modulo;
  const Shown one = shown_at(effect, {0.8, 0, 3.317}), other = shown_at(effect, {0.8 - turn, 0, 3.317});
  const double apart_mm = largest_distance_mm(one.path, other.path);
  EXPECT_GT(apart_mm, 0.05);
  EXPECT_LT(apart_mm, 4 * agar().curvature_per_mm * 30);  // and 30 mm of way left
  EXPECT_GT(largest_distance_mm(one.path, one.nominal), 2 * apart_mm);
}

TEST(Registry, PlacesWhereAnEffectBeginsAreDeclared) {
  std::set<std::string> depths, instants;
  for (const Effect* effect : all_effects())
    for (const auto& p : effect->parameters()) {
      const std::string name = std::string(effect->name()) + "." + std::string(p.name);
      if (p.begins == Begins::depth) depths.insert(name);
      if (p.begins == Begins::instant) instants.insert(name);
      // The engine scans an instant over each recording.
      EXPECT_EQ(p.begins == Begins::instant, p.scope == Scope::recording && !p.periodic) << name;
    }
  EXPECT_EQ(depths, (std::set<std::string>{"layer.depth_mm", "puncture.depth_mm"}));
  EXPECT_EQ(instants, (std::set<std::string>{"lost_steps.at_s"}));
}

TEST(EffectParameter, OfValuesThatAreTheSameTheNearestToNoneIsMeant) {
  const EffectParameter& rotation = find_effect("lost_steps")->parameters()[0];
  EXPECT_NEAR(meant(rotation, -4.943), 1.340, 1e-3);
  EXPECT_NEAR(meant(rotation, 1.34), 1.34, 1e-12);
  EXPECT_NEAR(meant(rotation, 6.9), 6.9 - 2 * std::numbers::pi, 1e-12);
  EXPECT_EQ(meant(find_effect("lost_steps")->parameters()[1], 12.0), 12.0);
  EffectParameter about_three{.name = "", .lower = 0, .upper = 9, .none = 3, .starts = {1}, .modulo = 2};
  EXPECT_NEAR(meant(about_three, 8.5), 2.5, 1e-12);
}

TEST(Registry, NamesAreThoseOfTheContract) {
  std::set<std::string_view> names;
  for (const Effect* effect : all_effects()) names.insert(effect->name());
  EXPECT_EQ(names.size(), all_effects().size());
  EXPECT_EQ(names, (std::set<std::string_view>{"rotation_backlash",
                                               "torsional_windup",
                                               "insertion_backlash",
                                               "insertion_scale",
                                               "lost_steps",
                                               "rate_dependence",
                                               "layer",
                                               "depth_dependence",
                                               "drilling",
                                               "flip_transient",
                                               "relaxation",
                                               "puncture",
                                               "stick_slip",
                                               "tissue_motion",
                                               "lateral_bias",
                                               "bevel_offset",
                                               "entry_angle",
                                               "camera_latency",
                                               "cutting_angle",
                                               "entry_point",
                                               "sensor_tilt",
                                               "tip_swing",
                                               "camera_scale",
                                               "camera_rotation",
                                               "refraction",
                                               "slip_direction"}));
  EXPECT_EQ(find_effect("gravity"), nullptr);
}

TEST(Registry, OutOfBoundsIsFound) {
  const Effect& layer = *find_effect("layer");
  EXPECT_EQ(find_parameter_violation(layer, std::vector{30.0, 1.0}), -1);
  EXPECT_EQ(find_parameter_violation(layer, std::vector{-1.0, 1.0}), 0);
  EXPECT_EQ(find_parameter_violation(layer, std::vector{30.0, std::nan("")}), 1);
}

TEST(AugmentedNeedle, WithoutEffectsIsTheModelBitForBit) {
  for (const int columns : {0, 4}) {
    const AugmentedNeedle needle(agar(), {}, columns, columns ? NeedleColumns{0, 1, 2, 3} : NeedleColumns{});
    const Motion motion = rich_script().recorded();
    AugmentedState state = needle.entry(motion.nodes.front());
    Pose pose;
    for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
      const auto& a = motion.nodes[i - 1];
      const auto& b = motion.nodes[i];
      const StepInput input{b.insertion_mm - a.insertion_mm, b.rotation_rad - a.rotation_rad, {0.0047, 0}};
      StepJacobian J;
      ASSERT_TRUE(columns ? advance(pose, input, slip_parameters(agar()), J)
                          : advance(pose, input, slip_parameters(agar())));
      ASSERT_TRUE(needle.advance(state, b));
      ASSERT_EQ(state.pose.R, pose.R);
      ASSERT_EQ(state.pose.p_mm, pose.p_mm);
    }
  }
}

TEST(AugmentedNeedle, StaysWhereItIsOutsideTheDomain) {
  NeedleParameters sharp;
  sharp.curvature_per_mm = 0.03;
  sharp.lambda1_per_rad = 0.144;
  sharp.lambda2 = 0.032;
  const AugmentedNeedle needle(sharp, {testing::active("insertion_scale", {0.9})});
  AugmentedState state = needle.entry({});
  BaseMotion base;
  Pose before;
  do {
    before = state.pose;
    base.time_s += 0.1;
    base.insertion_mm += 1;
  } while (base.insertion_mm < 200 && needle.advance(state, base));
  EXPECT_LT(base.insertion_mm, 200);
  EXPECT_EQ(state.pose.p_mm, before.p_mm);
  EXPECT_EQ(state.base.insertion_mm, base.insertion_mm - 1);
  const Motion motion = Script{{10, 20, 0}}.recorded();
  OpenLoop path;
  EXPECT_FALSE(predict(needle, motion, path));
}

TEST(AugmentedNeedle, RefusesMoreThanItHasRoomFor) {
  const auto one = testing::active("camera_scale", {1.01});
  EXPECT_THROW(AugmentedNeedle(agar(), std::vector<ActiveEffect>(kMaxEffects + 1, one)), bevel::ArgumentError);
  EXPECT_THROW(AugmentedNeedle(agar(), {}, kMaxColumns + 1), bevel::ArgumentError);
}

}  // namespace
}  // namespace bevel::model::testing
