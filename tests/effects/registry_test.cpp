// What holds for every effect of the registry: none at its `none`, right sensitivities, an order of its own.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

// Sizes at which an effect shows along rich_script(), away from the corners of its law.
std::vector<double> shown(const Effect& effect) {
  static const std::map<std::string_view, std::vector<double>> sizes{{"slip_direction", {}},
                                                                     {"entry_angle", {0.05, -0.03}},
                                                                     {"bevel_offset", {0.35}},
                                                                     {"lost_steps", {0.8, -1.3, 3.317}},
                                                                     {"rotation_backlash", {0.37}},
                                                                     {"torsional_windup", {0.83}},
                                                                     {"insertion_backlash", {1.13}},
                                                                     {"insertion_scale", {0.93}},
                                                                     {"puncture", {11.3, 2.3}},
                                                                     {"flip_transient", {6.3}},
                                                                     {"rate_dependence", {0.21}},
                                                                     {"layer", {30.3, 0.7}},
                                                                     {"depth_dependence", {0.5}},
                                                                     {"drilling", {1.7}},
                                                                     {"lateral_bias", {0.0007, -0.0011}},
                                                                     {"relaxation", {1.1, 2.2, 4.3}},
                                                                     {"tissue_motion", {1.2, 0.27, 0.9, 2.0}},
                                                                     {"camera_rotation", {0.03}},
                                                                     {"camera_scale", {1.03}},
                                                                     {"refraction", {0.03, 25}},
                                                                     {"camera_latency", {0.1117}}};
  return sizes.at(effect.name());
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
  EXPECT_GT(largest_distance_mm(path_of(agar(), {testing::active(GetParam()->name(), shown(*GetParam()))}, motion),
                                path_of(agar(), {}, motion)),
            0.05);
}

// Bit for bit, with two exceptions that come to the same by another way: a flip transient of no length turns (k, 0)
// into the roll frame and back, and a membrane without indentation gives back the base's place as touched + pushed.
// slip_direction has no size at which it vanishes: it is there or not.
TEST_P(EveryEffect, ChangesNothingAtItsNone) {
  const Effect& effect = *GetParam();
  if (effect.parameters().empty()) GTEST_SKIP() << effect.name() << " has no parameter";
  const Motion motion = rich_script().recorded();
  const auto path = path_of(agar(), {testing::active(effect.name(), at_none(effect))}, motion);
  const auto nominal = path_of(agar(), {}, motion);
  static const std::set<std::string_view> to_rounding{"flip_transient", "puncture"};
  if (to_rounding.contains(effect.name())) {
    EXPECT_LT(largest_distance_mm(path, nominal), 1e-12 * 62);
  } else {
    EXPECT_EQ(path, nominal);
  }
}

// The Jacobian of model::predict against central differences of it, for k, lambda1, lambda2, ell and all parameters.
void expect_sensitivities(const std::vector<const Effect*>& effects, double tolerance) {
  const Motion motion = rich_script().recorded();
  constexpr int kNeedleColumns = 4;
  std::vector<double> values{agar().curvature_per_mm, agar().lambda1_per_rad, agar().lambda2, agar().wheelbase_mm};
  for (const Effect* effect : effects)
    for (const double v : shown(*effect)) values.push_back(v);
  const auto needle_at = [&](const std::vector<double>& at, int columns) {
    NeedleParameters needle = agar();
    needle.curvature_per_mm = at[0];
    needle.lambda1_per_rad = at[1];
    needle.lambda2 = at[2];
    needle.wheelbase_mm = at[3];
    std::vector<ActiveEffect> all;
    int column = kNeedleColumns;
    for (const Effect* effect : effects) {
      const auto first = at.begin() + column;
      const std::vector<double> own(first, first + static_cast<std::ptrdiff_t>(effect->parameters().size()));
      all.push_back(active(*effect, own, column));
    }
    if (columns == 0)
      for (auto& one : all)
        for (auto& p : one.parameters) p = Dual(p.value);
    return AugmentedNeedle(needle, all, columns, {0, 1, 2, 3});
  };
  const OpenLoop path = run(needle_at(values, static_cast<int>(values.size())), motion);
  for (std::size_t c = 0; c < values.size(); ++c) {
    const double h = 1e-6 * std::max(std::abs(values[c]), 1e-2);
    std::vector<double> up = values, down = values;
    up[c] += h;
    down[c] -= h;
    const auto a = run(needle_at(up, 0), motion).position_mm;
    const auto b = run(needle_at(down, 0), motion).position_mm;
    Eigen::VectorXd differences(3 * a.size());
    for (std::size_t i = 0; i < a.size(); ++i)
      differences.segment<3>(static_cast<Eigen::Index>(3 * i)) = (a[i] - b[i]) / (2 * h);
    const auto column = path.jacobian.col(static_cast<Eigen::Index>(c));
    std::string who;
    for (const Effect* effect : effects) who += std::string(effect->name()) + " ";
    EXPECT_LT((column - differences).cwiseAbs().maxCoeff(), tolerance * differences.cwiseAbs().maxCoeff())
        << who << "column " << c;
    EXPECT_GT(differences.cwiseAbs().maxCoeff(), 0) << who << "column " << c;
  }
}

TEST_P(EveryEffect, HasTheSensitivitiesOfFiniteDifferences) { expect_sensitivities({GetParam()}, 2e-6); }

TEST_P(EveryEffect, HasThemBesideEveryOther) {
  for (const Effect* other : all_effects())
    if (other != GetParam() && other->parameters().size() + GetParam()->parameters().size() + 4 <= kMaxColumns)
      expect_sensitivities({GetParam(), other}, 2e-5);
}

TEST_P(EveryEffect, DoesNotMindWhereItIsListed) {
  const Motion motion = rich_script().recorded();
  const auto one = testing::active(GetParam()->name(), shown(*GetParam()));
  for (const Effect* other : all_effects()) {
    const auto two = testing::active(other->name(), shown(*other));
    EXPECT_EQ(path_of(agar(), {one, two}, motion), path_of(agar(), {two, one}, motion)) << other->name();
  }
}

// Sensitivities come along: they may not change the path.
TEST_P(EveryEffect, HasTheSamePathWithAndWithoutColumns) {
  const Motion motion = rich_script().recorded();
  int column = 0;
  const auto with = active(*GetParam(), shown(*GetParam()), column);
  const auto without = testing::active(GetParam()->name(), shown(*GetParam()));
  EXPECT_LT(largest_distance_mm(run(AugmentedNeedle(agar(), {with}, column), motion).position_mm,
                                path_of(agar(), {without}, motion)),
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
  }
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
                                               "tissue_motion",
                                               "lateral_bias",
                                               "bevel_offset",
                                               "entry_angle",
                                               "camera_latency",
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
  EXPECT_THROW(AugmentedNeedle(agar(), std::vector<ActiveEffect>(kMaxEffects + 1, one)), std::invalid_argument);
  EXPECT_THROW(AugmentedNeedle(agar(), {}, kMaxColumns + 1), std::invalid_argument);
}

}  // namespace
}  // namespace bevel::model::testing
