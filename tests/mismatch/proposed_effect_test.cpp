// SPDX-License-Identifier: MIT
// Effects out of proposals, compiled as they were written: they say the equations that were weighed, with their slopes,
// and are effects like all others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include <bevel/io/model_file.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include "tests/effects/script.hpp"
#include "tests/mismatch/proposed_cases.hpp"

namespace bevel::diagnosis::testing {
namespace {

using inference::Form;
using model::testing::active;
using model::testing::agar;
using model::testing::path_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Values = std::vector<double>;

// The sources are named as if none of them were in the registry, which they are here.
std::string name_of_case(const ProposedForm& p) {
  const std::string next = effect_source(p).name;
  EXPECT_TRUE(next.ends_with("_2")) << next;
  return next.substr(0, next.size() - 2);
}

// A sinusoid's amplitude is not negative: half a turn of its phase stands for the sign.
Values parameters_of(const ProposedForm& p, double shape) {
  if (p.form != Form::sinusoid) return {p.amplitude, shape};
  const double phase = p.amplitude < 0 ? p.phase_rad + std::numbers::pi : p.phase_rad;
  return p.periodic ? Values{std::abs(p.amplitude), phase} : Values{std::abs(p.amplitude), shape, phase};
}

struct EveryProposal : ::testing::TestWithParam<ProposedForm> {
  const ProposedForm& proposal = GetParam();
  const std::string name = name_of_case(proposal);
};
INSTANTIATE_TEST_SUITE_P(Forms, EveryProposal, ::testing::ValuesIn(proposed_cases()),
                         [](const auto& of) { return name_of_case(of.param); });

// One leg that ends at a place: what the effect makes of it is the equation's value there.
double value_at(const model::Effect& effect, const Values& values, model::Covariate covariate, double place) {
  std::vector<model::Dual> p(values.begin(), values.end());
  model::EffectMemory memory;
  model::LegView leg;
  constexpr double kStep = 1e-3;  // mm, rad, s: the leg's own length
  leg.entry = leg.from = {0, 0, 0};
  leg.R.setIdentity();
  leg.R_body.setZero();
  leg.to = {kStep, kStep, kStep};
  leg.insertion_mm = kStep;
  if (covariate == model::Covariate::depth_mm || covariate == model::Covariate::since_reversal_mm) {
    leg.to.insertion_mm = place, leg.from.insertion_mm = place - kStep;
  }
  if (covariate == model::Covariate::since_reversal_mm) leg.to.rotation_rad = 0;
  if (covariate == model::Covariate::withdrawn_mm) leg.to.insertion_mm = -place, leg.from.insertion_mm = -place + kStep;
  if (const auto along = model::tip_direction(covariate))
    for (std::size_t i = 0; i < 2; ++i) leg.tip_side_mm[i] = place * (*along)[static_cast<Eigen::Index>(i)];
  if (covariate == model::Covariate::time_s) leg.to.time_s = place, leg.from.time_s = place - kStep;
  if (covariate == model::Covariate::roll_rad || covariate == model::Covariate::turned_rad)
    leg.to.rotation_rad = place, leg.from.rotation_rad = place - kStep;
  if (model::adds_up(covariate))
    leg.speed_changes_mm_s.at(static_cast<std::size_t>(std::lround(place / model::kSpeedChange_s)) - 1) = kStep;
  model::Dual insertion, rotation;
  model::Dual2 kappa;
  model::Dual3 point;
  effect.axes(p, leg, memory, insertion, rotation);
  effect.curvature(p, leg, memory, kappa);
  effect.settle(p, leg, memory);
  effect.offset(p, memory, 0, point);
  if (const double along = insertion.value + rotation.value; along != 0) return along / kStep;
  if (kappa[0].value != 0 || kappa[1].value != 0) return kappa[0].value + kappa[1].value;
  if (point[2].value != 0) return point[2].value / kStep;
  return point[0].value != 0 ? point[0].value / kStep : point[1].value;
}

TEST_P(EveryProposal, IsTheEquationThatWasWeighed) {
  const model::Effect* effect = model::find_effect(name);
  ASSERT_NE(effect, nullptr);
  const inference::Curve places = places_of(proposal);
  int compared = 0;
  for (const double shape : proposal.shapes) {
    if (proposal.periodic && shape != proposal.shape) continue;  // a constant of the source
    const Values values = parameters_of(proposal, shape);
    EXPECT_EQ(find_parameter_violation(*effect, values), -1);
    for (int i = -2; i <= 32; ++i) {
      const double place = model::adds_up(proposal.covariate) ? model::kSpeedChange_s * (1 + std::abs(i) % 12)
                                                              : proposal.low + proposal.range * (i + 0.37) / 29;
      // A step is a fiftieth of the range wide, or as wide as what is looked at is apart.
      const double wide = model::adds_up(proposal.covariate) ? model::kSpeedChange_s : 0.02 * proposal.range;
      if (proposal.form == Form::step && std::abs(place - shape) < 0.5 * wide) continue;
      const double expected = proposal.amplitude * value_of(proposal.form, places, shape, proposal.phase_rad, place);
      EXPECT_NEAR(value_at(*effect, values, proposal.covariate, place), expected,
                  1e-9 * std::abs(proposal.amplitude) + 1e-8 * std::abs(expected))
          << "at " << place << ", shape " << shape;
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
}

TEST_P(EveryProposal, HasItsSensitivities) {
  const model::Motion motion = model::testing::rich_script().recorded();
  // Away from the places that a leg ends on, where a step's edge and a ramp's corner have two slopes.
  const Values values = parameters_of(proposal, proposal.shape + 1e-4 * proposal.range * (proposal.periodic ? 0 : 1));
  model::ActiveEffect one = active(name, values);
  for (std::size_t i = 0; i < values.size(); ++i)
    one.parameters[i] = model::Dual::unknown(values[i], static_cast<int>(i));
  const auto columns = static_cast<int>(values.size());
  const model::OpenLoop path = model::testing::run(model::AugmentedNeedle(agar(), {one}, columns), motion);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double step = 1e-6 * std::max(std::abs(values[i]), 1e-3);
    Values up = values, down = values;
    up[i] += step, down[i] -= step;
    const auto above = path_of(agar(), {active(name, up)}, motion);
    const auto below = path_of(agar(), {active(name, down)}, motion);
    double off = 0, size = 0;
    for (std::size_t r = 0; r < above.size(); ++r) {
      const Eigen::Vector3d difference = (above[r] - below[r]) / (2 * step);
      const Eigen::Vector3d column =
          path.jacobian.block<3, 1>(static_cast<Eigen::Index>(3 * r), static_cast<Eigen::Index>(i));
      off = std::max(off, (difference - column).norm());
      size = std::max(size, difference.norm());
    }
    EXPECT_LT(off, 2e-3 * size) << "parameter " << i;
    EXPECT_GT(size, 0) << "parameter " << i;  // a fit can move it, a step too
  }
}

TEST_P(EveryProposal, VanishesWithoutItsAmplitude) {
  const model::Motion motion = model::testing::rich_script().recorded();
  Values values = parameters_of(proposal, proposal.shape);
  EXPECT_GT(
      model::testing::largest_distance_mm(path_of(agar(), {active(name, values)}, motion), path_of(agar(), {}, motion)),
      1e-3);
  values[0] = model::find_effect(name)->parameters()[0].none;
  EXPECT_EQ(path_of(agar(), {active(name, values)}, motion), path_of(agar(), {}, motion));
}

// What a diagnosis takes from an effect: see needle_system.cpp.
TEST_P(EveryProposal, SaysWhatADiagnosisNeeds) {
  const model::Effect& effect = *model::find_effect(name);
  EXPECT_EQ(effect.covariate(), proposal.covariate);
  EXPECT_THAT(std::string(effect.meaning()), HasSubstr(std::string(info_of(proposal.component).meaning)));
  const auto& all = effect.parameters();
  ASSERT_EQ(all.size(), parameters_of(proposal, proposal.shape).size());
  EXPECT_NEAR(all[0].reported, std::abs(proposal.amplitude), 1e-2 * all[0].reported);
  for (const auto& p : all) {
    ASSERT_FALSE(p.starts.empty());
    for (const double start : p.starts) {
      EXPECT_GE(start, p.lower) << p.name;
      EXPECT_LE(start, p.upper) << p.name;
    }
    if (&p != all.data()) {
      EXPECT_TRUE(std::isnan(p.none)) << p.name;
      EXPECT_TRUE(p.periodic || p.likely_low < p.likely_high) << p.name;
    }
  }
  EXPECT_EQ(all.back().periodic, proposal.form == Form::sinusoid);
}

// The lines for a model file that its comment holds are accepted, and mean what was proposed.
TEST_P(EveryProposal, CanBeUsedAsItWasFound) {
  std::string text = effect_source(proposal).text;
  text = text.substr(text.find("//   [[effect]]"));
  text = text.substr(0, text.find("//\n"));
  for (std::size_t at = 0; (at = text.find("//   ")) != std::string::npos;) text.erase(at, 5);
  text.replace(text.find("_2\""), 2, "");  // see name_of_case()
  const io::ModelFile model = io::parse_model_file(
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n" + text,
      "model.toml");
  const auto effects = io::active_effects(model, "");
  ASSERT_EQ(effects.size(), 1U);
  EXPECT_EQ(effects[0].effect, model::find_effect(name));
  const Values expected = parameters_of(proposal, proposal.shape);
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(effects[0].parameters[i].value, expected[i], 1e-5 * std::abs(expected[i])) << i;
}

// A tip that does not advance as its base does, in closed form: ds_tip = (1 + a (1 - exp(-x / s))) dx.
TEST(ProposedEffect, PredictsARecordingOfWhatItSays) {
  constexpr double kLow = 0.25;  // of the compiled source
  const double a = -0.08, s = 17;
  const model::Motion motion = model::testing::Script{{1.5, 12, 0.4}, {0.5, 0, 3}, {2, 10, 0}, {1, 16, -1}}.fine();
  model::Motion true_motion = motion;
  for (auto& node : true_motion.nodes)
    if (const double x = node.insertion_mm - kLow; x > 0) node.insertion_mm += a * (x - s * (1 - std::exp(-x / s)));
  const auto recorded = path_of(agar(), {}, true_motion);
  // Through a model file, as a person would use it.
  const io::ModelFile model = io::parse_model_file(
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n"
      "[[effect]]\nname = \"advance_saturation_by_depth\"\namplitude_mm_per_mm = -0.08\nshape_mm = 17\n",
      "model.toml");
  EXPECT_GT(model::testing::largest_distance_mm(path_of(model.needle, {}, motion), recorded), 1);
  const auto predicted = path_of(model.needle, io::active_effects(model, ""), motion);
  EXPECT_LT(model::testing::largest_distance_mm(predicted, recorded), 1e-3);
  // And as the discrepancy for which it would have been proposed, where that has values enough.
  model::DiscrepancyCurve curve{model::DiscrepancyComponent::advance, model::Covariate::depth_mm, {}, {}, {}};
  for (std::size_t i = 0; i < model::kMaxKnots; ++i) {
    const double x = kLow + 60.0 * static_cast<double>(i) / (model::kMaxKnots - 1);
    curve.at.push_back(x);
    curve.values.push_back(a * (1 - std::exp(-(x - kLow) / s)));
    curve.std_errors.push_back(0);
  }
  EXPECT_LT(
      model::testing::largest_distance_mm(predicted, path_of(model.needle, {model::active_discrepancy(curve)}, motion)),
      1e-3);
}

TEST(ProposedEffect, SaysWhereItIsFrom) {
  ProposedForm p = proposed_cases().front();
  p.amplitude_sd = 0.00004, p.shape_low = 11, p.shape_high = 14.5, p.log_bayes_factor = 6.53;
  const std::string text = effect_source(p).text;
  EXPECT_THAT(text, AllOf(HasSubstr("curvature toward the bevel is off by a step over depth"),
                          HasSubstr("x: depth_mm, from 0.5 to 55.5"), HasSubstr("standard error 4e-05 1/mm"),
                          HasSubstr("95 % 11 to 14.5"), HasSubstr("all curves 6.53")));
  EXPECT_THAT(text, AllOf(HasSubstr("amplitude_per_mm"), HasSubstr("shape_mm"), Not(HasSubstr("@"))));
}

TEST(ProposedEffect, IsThereForAnUnknownEffectAlone) {
  Findings findings;
  EXPECT_FALSE(proposed_effect(findings));
  findings.proposals = {proposed_cases()[4], proposed_cases()[0]};
  EXPECT_FALSE(proposed_effect(findings));
  findings.verdict = Verdict::unknown_effect;
  findings.discrepancies.resize(2);
  findings.discrepancies[0].visible_size = 2;
  findings.discrepancies[1].visible_size = 0.2;
  // Of two forms of one discrepancy the likelier, and of two discrepancies that which shows more.
  findings.proposals[0].log_bayes_factor = 3, findings.proposals[1].log_bayes_factor = 1;
  ASSERT_TRUE(proposed_effect(findings));
  EXPECT_EQ(proposed_effect(findings)->name, effect_source(proposed_cases()[4]).name);
  findings.proposals[0].discrepancy = 1;
  EXPECT_EQ(proposed_effect(findings)->name, effect_source(proposed_cases()[0]).name);
  findings.proposals.clear();
  EXPECT_FALSE(proposed_effect(findings));
}

}  // namespace
}  // namespace bevel::diagnosis::testing
