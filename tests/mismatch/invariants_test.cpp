// SPDX-License-Identifier: MIT
// The invariants of a verdict, on findings that were made up and on whole diagnoses of simulated rigs.
#include <bevel/diagnosis/mismatch/invariants.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

FoundEffect windup() {
  FoundEffect effect{.name = "torsional_windup", .meaning = "", .probability = 0.9, .joint_probability = 0.9};
  effect.parameters = {{.name = "lag_at_100mm_rad", .value = 0.6, .std_error = 0.05, .ci95 = {0.5, 0.7}, .none = 0}};
  effect.log_bayes_factor = 12;
  return effect;
}

HeldOutRecording held_out(double before, double after) {
  HeldOutRecording out;
  out.predicted_before.whole.log_density = before;
  out.predicted_after.whole.log_density = after;
  return out;
}

Findings sound() {
  Findings f;
  f.verdict = Verdict::effects_found;
  f.effects = {windup()};
  f.held_out.recordings = {held_out(-1, -0.2), held_out(-1.1, -0.3), held_out(-0.9, -0.2)};
  return f;
}

TEST(Violations, AreNoneOfASoundVerdict) { EXPECT_THAT(violations(sound()), IsEmpty()); }

TEST(Violations, AnUnlikelyNameIsOneUnlessItsConfoundersAreListed) {
  Findings f = sound();
  f.effects[0].probability = f.effects[0].joint_probability = 0.25;
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("probability of 0.25")));
  f.effects[0].ambiguous_with = {"rotation_backlash"};
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("probability of 0.25")));
  f.effects[0].joint_probability = 0.8;
  EXPECT_THAT(violations(f), IsEmpty());
}

TEST(Violations, ASizeThatMayBeNoneIsOne) {
  Findings f = sound();
  f.effects[0].parameters[0].ci95 = {-0.04, 0.7};
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("includes no effect")));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  f.effects[0].parameters[0].ci95 = {nan, nan};
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("includes no effect")));
  // One size of two is enough; a parameter at which nothing vanishes is no size.
  f.effects[0].parameters.push_back({.name = "other", .value = 2, .ci95 = {1, 3}});
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("includes no effect")));
  f.effects[0].parameters[1].none = 0;
  EXPECT_THAT(violations(f), IsEmpty());
}

TEST(Violations, ALogBayesFactorThatIsNotPositiveIsOne) {
  Findings f = sound();
  f.effects[0].log_bayes_factor = -7;
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("log Bayes factor of torsional_windup is -7")));
}

TEST(Violations, TooMuchProbabilityInModelsThatWereNotFittedIsOne) {
  Findings f = sound();
  f.not_visited = 0.2;
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("not fitted")));
}

TEST(Violations, AnAdoptedModelThatPredictsWorseIsOne) {
  Findings f = sound();
  f.held_out.recordings = {held_out(-0.2, -0.9), held_out(-0.3, -1), held_out(-0.2, -0.8)};
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("predicts left-out recordings worse")));
  // Not beyond the standard error between recordings.
  f.held_out.recordings = {held_out(-0.2, -0.9), held_out(-1, -0.2), held_out(-0.2, -0.4)};
  EXPECT_THAT(violations(f), IsEmpty());
}

TEST(Violations, AValueAtTheEndOfItsRangeIsMarked) {
  Findings f = sound();
  f.effects[0].parameters[0].value = 4;
  f.effects[0].parameters[0].ci95 = {3.5, 4};
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("at the end of its range")));
  f.effects[0].parameters[0].at_bound = true;
  EXPECT_THAT(violations(f), IsEmpty());
}

TEST(Violations, AnEquationWhoseSizeMayBeNoneIsOne) {
  Findings f = sound();
  f.proposals = {{.equation = "a exp(-x / s)",
                  .amplitude = -58,
                  .amplitude_sd = 668,
                  .shape = 1,
                  .shape_low = 0.5,
                  .shape_high = 2}};
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("includes none")));
  f.proposals[0].amplitude_sd = 20;
  EXPECT_THAT(violations(f), IsEmpty());
  f.proposals[0].shape = 0.4;
  EXPECT_THAT(violations(f), UnorderedElementsAre(HasSubstr("outside its interval")));
}

TEST(Violations, AnInconclusiveVerdictNamesNothingAndStatesWhy) {
  Findings f = sound();
  f.verdict = Verdict::inconclusive;
  EXPECT_EQ(violations(f).size(), 2U);
  f.effects.clear();
  f.not_visited = 0.5;
  f.reasons = {"half of the probability is in candidate models that were not fitted"};
  EXPECT_THAT(violations(f), IsEmpty());
}

// Whole diagnoses. The prior of a size costs at most log(0.47 sd / scale) in log evidence (half Student's t of 4
// degrees of freedom), which is -7.7 for a standard error of a thousandth of the prior's scale; with two sizes twice as
// much.
constexpr double kLeastOfOneSize = -8;

void expect_sound(const Findings& found) {
  EXPECT_THAT(violations(found), IsEmpty()) << found.sentence;
  for (const auto* list : {&found.tried, &found.beside})
    for (const TriedEffect& one : *list)
      if (one.fitted && one.log_bayes_factor) {
        EXPECT_GT(*one.log_bayes_factor,
                  kLeastOfOneSize * std::max<double>(1, static_cast<double>(one.parameters.size())))
            << one.name << " beside " << one.beside;
      }
  double sum = 0;
  for (const Explanation& one : found.explanations) sum += one.probability;
  EXPECT_LE(sum, 1 + 1e-9) << "given that a fitted model is true";
  if (found.probability >= kNoDoubt) {
    EXPECT_FALSE(found.next_experiment.has_value());
  }
  for (const Location& where : found.where) EXPECT_LE(where.to_s - where.from_s, 5) << "of 7 to 9 s";
}

struct Case {
  const char* name;
  SimulatedRig rig;
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class EveryVerdict : public ::testing::TestWithParam<Case> {};

TEST_P(EveryVerdict, KeepsTheInvariants) {
  model::NeedleParameters model = GetParam().rig.needle;
  model.curvature_per_mm *= 1.08;
  expect_sound(diagnose(record_case(GetParam().rig, 7), model, {}));
}

std::vector<Case> cases() {
  SimulatedRig sinking;
  sinking.true_motion = [](std::vector<model::ActuatorState>& states) {
    for (auto& state : states) state.rotation_rad += 0.8 * std::sin(state.insertion_mm / 9);
  };
  return {{"Null", {.recordings = 3, .ar1 = 0.6}},
          {"Windup", {.effects = {active("torsional_windup", {0.7})}, .recordings = 3}},
          {"FaintLayer", {.effects = {active("layer", {30, 0.93})}, .recordings = 3}},
          {"Unlisted", sinking}};
}

INSTANTIATE_TEST_SUITE_P(Simulated, EveryVerdict, ::testing::ValuesIn(cases()),
                         [](const auto& one) { return std::string(one.param.name); });

// Equivalent forms of the same recordings.
struct Form {
  const char* name;
  bool reversed = false;  // and with other names
  std::int64_t clock_us = 0;
  double turn_rad = 0;  // of the frame about z; the model file states the roll of the bevel in it
};
void PrintTo(const Form& one, std::ostream* out) { *out << one.name; }

class EveryForm : public ::testing::TestWithParam<Form> {};

TEST_P(EveryForm, GivesTheSameVerdict) {
  const SimulatedRig rig{.effects = {active("torsional_windup", {0.7})}, .recordings = 3};
  auto raw = record(rig, 7);
  const Findings plain = diagnose(make_case(raw), rig.needle, {});
  const Form& form = GetParam();
  if (form.reversed) std::ranges::reverse(raw);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(form.turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (std::size_t r = 0; r < raw.size(); ++r) {
    if (form.reversed) raw[r].name = "another_" + std::to_string(r);
    for (auto& state : raw[r].actuators) state.utime += form.clock_us;
    for (auto& tip : raw[r].tips) {
      tip.utime += form.clock_us;
      tip.position_mm = turn * tip.position_mm;
      tip.information_per_mm2 = turn * tip.information_per_mm2 * turn.transpose();
    }
  }
  DiagnosisOptions options;
  if (form.turn_rad != 0) options.known.elsewhere = {active("bevel_offset", {form.turn_rad})};
  options.known.in_recording.assign(raw.size(), options.known.elsewhere);
  const Findings other = diagnose(make_case(raw), rig.needle, options);
  EXPECT_EQ(other.verdict, plain.verdict) << plain.sentence << '\n' << other.sentence;
  ASSERT_EQ(other.effects.size(), plain.effects.size());
  for (std::size_t e = 0; e < plain.effects.size(); ++e) {
    EXPECT_EQ(other.effects[e].name, plain.effects[e].name);
    const FoundParameter &a = plain.effects[e].parameters[0], &b = other.effects[e].parameters[0];
    EXPECT_NEAR(b.value, a.value, a.std_error) << a.name;
  }
  EXPECT_NEAR(other.needle.value.curvature_per_mm, plain.needle.value.curvature_per_mm,
              plain.needle.curvature_sd_per_mm);
}

INSTANTIATE_TEST_SUITE_P(OfTheRecordings, EveryForm,
                         ::testing::Values(Form{.name = "Reversed", .reversed = true},
                                           Form{.name = "OtherClock", .clock_us = 86'400'000'000},
                                           Form{.name = "QuarterTurn", .turn_rad = M_PI / 2},
                                           Form{.name = "ObliqueFrame", .turn_rad = 0.6}),
                         [](const auto& one) { return std::string(one.param.name); });

// The error of the path goes on growing to the end of the recording; the physics begins at the layer.
TEST(Onset, IsWhereTheNeedleReachesALayer) {
  const SimulatedRig rig{.effects = {active("layer", {30, 2})}, .recordings = 3};
  const Findings found = diagnose(record_case(rig, 3), rig.needle, {});
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].name, "layer");
  ASSERT_FALSE(found.where.empty());
  for (const Location& where : found.where) {
    EXPECT_EQ(where.covariate, "depth_mm");
    EXPECT_NEAR(where.range[0], 30, 2) << where.log;
    EXPECT_LT(where.range[1], 50) << where.log;
    EXPECT_GT(where.to_s, where.from_s);
    EXPECT_LT(where.to_s - where.from_s, 3) << where.log;
  }
}

}  // namespace
}  // namespace bevel::diagnosis::testing
