// SPDX-License-Identifier: MIT
// A whole diagnosis of a small rig: do the findings make sense together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include <bevel/diagnosis/mismatch/diagnose.hpp>
#include <bevel/diagnosis/mismatch/effect_source.hpp>
#include <bevel/error.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include "tests/needle/simulated_rig.hpp"

namespace bevel::diagnosis::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Findings findings_of(const SimulatedRig& rig, std::uint64_t seed, int threads = 2) {
  DiagnosisOptions options;
  options.threads = threads;
  // The lab's belief is somewhat wrong, as it always is.
  model::NeedleParameters model = rig.needle;
  model.curvature_per_mm *= 1.08;
  model.lambda1_per_rad += 0.05;
  return diagnose(record_case(rig, seed), model, options);
}

const SimulatedRig kWindup{.effects = {active("torsional_windup", {0.7})},
                           .recordings = 5,
                           .frame_s = 1.0 / 30,
                           .ar1 = 0.5,
                           .outlier_share = 0.01,
                           .dropped_share = 0.03};

TEST(Diagnose, FindsWindupAndSaysSoInEveryPlace) {
  const Findings found = findings_of(kWindup, 1);
  EXPECT_EQ(found.verdict, Verdict::effects_found) << found.sentence;
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  const FoundEffect& effect = found.effects[0];
  EXPECT_EQ(effect.name, "torsional_windup");
  EXPECT_THAT(found.sentence, HasSubstr("torsional_windup"));
  EXPECT_THAT(found.sentence, HasSubstr(effect.meaning));
  EXPECT_GT(effect.probability, 0.9);
  EXPECT_GT(effect.log_bayes_factor, 10);
  EXPECT_GT(effect.visible_sigmas, 5);
  ASSERT_EQ(effect.parameters.size(), 1U);
  const FoundParameter& lag = effect.parameters[0];
  EXPECT_EQ(lag.name, "lag_at_100mm_rad");
  EXPECT_NEAR(lag.value, 0.7, 4 * lag.std_error);
  EXPECT_LT(lag.ci95[0], lag.value);
  EXPECT_GT(lag.ci95[1], lag.value);

  // Its rig's noise, the outliers apart.
  ASSERT_EQ(found.noise.sigma.size(), 3U);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(found.noise.sigma[c] / kWindup.sigma_mm[static_cast<Eigen::Index>(c)], 1, 0.15);
  EXPECT_NEAR(found.noise.ar1, 0.5, 0.08);
  EXPECT_NEAR(found.noise.outlier_share, 0.01, 0.01);
  EXPECT_GT(found.outliers, 0U);
  EXPECT_EQ(found.channels, (std::vector<std::string>{"tip.x", "tip.y", "tip.z"}));

  // What was left out predicts; what is left is noise.
  EXPECT_NEAR(found.held_out.after.chi2_per_dof, 1, 0.1);
  EXPECT_GT(found.held_out.before.chi2_per_dof, found.held_out.after.chi2_per_dof);
  EXPECT_GT(found.held_out.before.rmse_mm, found.held_out.after.rmse_mm);
  EXPECT_GT(found.held_out.gain, 12);
  EXPECT_GT(found.held_out.before.rmse_mm, found.held_out.noise_floor.rmse_mm);
  EXPECT_GT(found.held_out.as_it_stands.chi2_per_dof, found.held_out.after.chi2_per_dof);
  EXPECT_LT(found.held_out.after.log_density, found.held_out.noise_floor.log_density + 0.05);
  EXPECT_EQ(found.held_out.recordings.size(), 5U);
  EXPECT_TRUE(found.checks.clean) << found.checks.chi2_per_dof << ' ' << found.checks.ljung_box_p;
  // Shares of one posterior.
  double sum = 0;
  for (const Explanation& one : found.explanations) sum += one.probability;
  EXPECT_LE(sum, 1 + 1e-9);
  EXPECT_GT(sum, 0.9);
  EXPECT_EQ(found.explanations.front().effects, std::vector<std::string>{"torsional_windup"});
  // The insertions do not differ, and that is what is said.
  for (const VariationEstimate& one : found.variation) EXPECT_LT(one.low, 1e-9) << one.name;

  // Located in recordings there are, in time they have, against what the effect acts on.
  ASSERT_FALSE(found.where.empty());
  for (const Location& where : found.where) {
    EXPECT_THAT(where.log, HasSubstr("rec"));
    EXPECT_THAT(where.channel, HasSubstr("tip."));
    EXPECT_GE(where.from_s, 0);
    EXPECT_GT(where.to_s, where.from_s);
    EXPECT_LT(where.to_s, 10);
    EXPECT_EQ(where.covariate, "depth_mm");
    EXPECT_GT(where.range[1], where.range[0]);
    EXPECT_GT(where.share, 0);
  }

  // The ranking, the pictures' data, the next experiment.
  ASSERT_GT(found.tried.size(), 15U);
  EXPECT_EQ(found.tried.front().name, "torsional_windup");
  EXPECT_TRUE(found.tried.front().likelier);
  for (const TriedEffect& tried : found.beside) EXPECT_FALSE(tried.likelier) << tried.name;
  ASSERT_EQ(found.traces.size(), 5U);
  std::size_t outliers = 0;
  for (const Trace& trace : found.traces) {
    EXPECT_EQ(trace.after_mm.size(), trace.time_s.size());
    for (const char one : trace.outlier) outliers += one == 1 ? 1 : 0;
  }
  EXPECT_EQ(outliers, found.outliers);
  if (found.probability < kNoDoubt) {
    ASSERT_TRUE(found.next_experiment.has_value());
    EXPECT_EQ(found.next_experiment->separates[0], "torsional_windup");
  } else {
    EXPECT_FALSE(found.next_experiment.has_value()) << "none is needed";
  }
  EXPECT_EQ(found.confusion.rows(), static_cast<Eigen::Index>(found.confusion_names.size()));
  EXPECT_LE(found.confusion.maxCoeff(), 1);
  // The needle again as it is, not as the file has it.
  EXPECT_NEAR(found.needle.value.curvature_per_mm, kWindup.needle.curvature_per_mm,
              4 * found.needle.curvature_sd_per_mm);
}

// Its readings are no multiple of a small membrane's: where it breaks moves with how far it gives way.
TEST(Diagnose, FindsAMembraneThatGivesWayFarAndOneThatHardlyDoes) {
  for (const double indentation_mm : {4.5, 0.8}) {
    const Findings found = findings_of({.effects = {active("puncture", {21.3, indentation_mm})},
                                        .recordings = 6,
                                        .sigma_mm = {0.1, 0.1, 0.13},
                                        .ar1 = 0.6},
                                       5);
    ASSERT_EQ(found.effects.size(), 1U) << found.sentence << ' ' << indentation_mm;
    EXPECT_EQ(found.effects[0].name, "puncture");
    EXPECT_NEAR(found.effects[0].parameters[0].value, 21.3, 0.2);
    // Some of its few readings may pass for outliers: how far it gave way is then not known well, and that is said.
    EXPECT_NEAR(found.effects[0].parameters[1].value, indentation_mm, 3 * found.effects[0].parameters[1].std_error);
  }
}

TEST(Diagnose, WhereNothingIsMissingSaysHowSmallItWouldHaveSeen) {
  const Findings found = findings_of({.recordings = 4, .ar1 = 0.8}, 2);
  EXPECT_EQ(found.verdict, Verdict::nothing_missing) << found.sentence;
  EXPECT_THAT(found.effects, IsEmpty());
  EXPECT_THAT(found.where, IsEmpty());
  EXPECT_THAT(found.discrepancies, IsEmpty());
  EXPECT_GT(found.nothing_probability, 0.5);
  EXPECT_NEAR(found.held_out.after.chi2_per_dof, 1, 0.1);
  EXPECT_NEAR(found.held_out.gain, 0, 1);
  // Every amplitude of every effect that does anything, each with a size.
  std::set<std::string> effects;
  for (const DetectableSize& one : found.detectable) {
    effects.insert(one.effect);
    EXPECT_GT(one.size, 0) << one.effect << ' ' << one.parameter;
    EXPECT_GE(one.absorbed, -1e-9);
    EXPECT_LE(one.absorbed, 1 + 1e-9);
    if (!(one.size < one.typical)) {
      EXPECT_FALSE(one.experiment.empty()) << one.effect << " is not visible, and no motion is named";
    }
  }
  EXPECT_GT(effects.size(), 18U);
}

Findings of_exponent(double exponent) {
  return findings_of({.effects = {active("rate_dependence", {exponent})}, .recordings = 3, .frame_s = 0.1}, 1);
}

TEST(Diagnose, SaysOfAValueAtTheEndOfItsRangeThatItIsNone) {
  const Findings found = of_exponent(1.2);
  ASSERT_EQ(found.effects.size(), 1U) << found.sentence;
  EXPECT_EQ(found.effects[0].parameters[0].value, 1);  // the largest exponent that is fitted
  EXPECT_THAT(found.remarks, Contains(HasSubstr("rate_dependence: exponent lies at the end")));
}

TEST(Diagnose, WhatLiesFarBeyondARangeIsOnNoList) {
  const Findings found = of_exponent(1.4);
  EXPECT_EQ(found.verdict, Verdict::unknown_effect) << found.sentence;
  EXPECT_TRUE(found.effects.empty()) << found.sentence;
  ASSERT_FALSE(found.discrepancies.empty());
  EXPECT_EQ(found.discrepancies[0].curve.covariate, model::Covariate::speed_mm_s);
}

// The tip advances in waves of its own along the depth: on no list.
TEST(Diagnose, WhatIsOnNoListIsADiscrepancyWithItsErrors) {
  SimulatedRig rig;
  rig.true_motion = [](std::vector<model::ActuatorState>& states) {
    for (auto& s : states) s.insertion_mm += 1.5 * std::pow(std::sin(0.11 * s.insertion_mm), 2);
  };
  const Findings found = findings_of(rig, 4);
  EXPECT_EQ(found.verdict, Verdict::unknown_effect) << found.sentence;
  // A curve of twelve values, straight between them, leaves a twelfth of such a wave, which may be a second one.
  ASSERT_FALSE(found.discrepancies.empty());
  const Discrepancy& one = found.discrepancies[0];
  for (std::size_t d = 1; d < found.discrepancies.size(); ++d)
    EXPECT_LT(found.discrepancies[d].visible_size, one.visible_size / 6);
  EXPECT_EQ(one.curve.values.size(), one.curve.at.size());
  EXPECT_EQ(one.curve.std_errors.size(), one.curve.at.size());
  for (const double error : one.curve.std_errors) EXPECT_GT(error, 0);
  EXPECT_GT(one.visible_size, 0.5);
  // What the tip advances more or less is 1.5 mm x 0.11 / mm x sin(0.22 / mm depth): a wave of 28.6 mm.
  ASSERT_FALSE(found.proposals.empty());
  EXPECT_EQ(found.proposals.front().form, inference::Form::sinusoid);
  EXPECT_EQ(found.proposals.front().covariate, model::Covariate::depth_mm);
  EXPECT_NEAR(found.proposals.front().shape, 28.6, 5);
  ASSERT_TRUE(proposed_effect(found).has_value());
  EXPECT_EQ(proposed_effect(found)->name, "advance_sinusoid_by_depth");
  EXPECT_LT(found.held_out.after.rmse_mm, found.held_out.before.rmse_mm);
  EXPECT_THAT(found.sentence, HasSubstr(std::string(info_of(one.curve.component).meaning)));
}

// The advance in waves, and a sideways bend in waves: no single curve is both.
TEST(Diagnose, TwoThingsThatAreOnNoListAreTwoCurves) {
  model::DiscrepancyCurve bend{.component = model::DiscrepancyComponent::curvature_across,
                               .covariate = model::Covariate::depth_mm};
  for (int i = 0; i <= 20; ++i) {
    bend.at.push_back(4.0 * i);
    bend.values.push_back(0.002 * std::sin(0.15 * bend.at.back()));
    bend.std_errors.push_back(0);
  }
  SimulatedRig rig{.effects = {model::active_discrepancy(bend)}};
  rig.true_motion = [](std::vector<model::ActuatorState>& states) {
    for (auto& s : states) s.insertion_mm += 1.5 * std::pow(std::sin(0.11 * s.insertion_mm), 2);
  };
  const Findings found = findings_of(rig, 4);
  EXPECT_EQ(found.verdict, Verdict::unknown_effect) << found.sentence;
  EXPECT_THAT(found.effects, IsEmpty()) << found.sentence;
  ASSERT_EQ(found.discrepancies.size(), 2U) << found.sentence;
  for (const Discrepancy& one : found.discrepancies) {
    const model::DiscrepancyCurve& curve = one.curve;
    EXPECT_EQ(curve.covariate, model::Covariate::depth_mm) << found.sentence;
    EXPECT_THAT(found.sentence, HasSubstr(std::string(info_of(curve.component).meaning)));
    EXPECT_GT(one.log_bayes_factor, 10);
    EXPECT_GT(one.visible_size, 0.5);
    EXPECT_GT(one.moved_at_depth_mm, 0.1);
    const bool advance = curve.component == model::DiscrepancyComponent::advance;
    EXPECT_TRUE(advance || curve.component == model::DiscrepancyComponent::curvature_across) << found.sentence;
    // As a share of what it is: an eighth of the depth from value to value, a quarter of a wave, smooths it, and what
    // of the wave is left passes for correlated noise.
    double off = 0, all = 0;
    for (std::size_t i = 0; i < curve.at.size(); ++i) {
      const double truth = advance ? 1.5 * 0.11 * std::sin(0.22 * curve.at[i]) : 0.002 * std::sin(0.15 * curve.at[i]);
      off += std::pow(curve.values[i] - truth, 2), all += truth * truth;
    }
    EXPECT_LT(std::sqrt(off / all), 0.7) << info_of(curve.component).name;
  }
  // Each has its equations.
  std::set<std::size_t> stands_for;
  for (const ProposedForm& one : found.proposals) stands_for.insert(one.discrepancy);
  EXPECT_EQ(stands_for.size(), 2U);
  EXPECT_NEAR(found.held_out.after.chi2_per_dof, 1, 0.25);
}

// A camera on a stand that every change of the base's speed sets ringing along z, for about a second.
class RingingStand final : public model::Effect {
 public:
  RingingStand()
      : Effect({.name = "ringing_stand", .meaning = "", .covariate = model::Covariate::time_s, .parameters = {}}) {}
  void settle(model::Parameters /*p*/, const model::LegView& leg, model::EffectMemory& memory) const override {
    constexpr double kNatural_rad_s = 2 * std::numbers::pi * 2, kDecay_per_s = 0.1 * kNatural_rad_s, kGain = 0.03;
    auto& [z_mm, rate_mm_s, speed_mm_s, unused1, unused2, unused3] = memory.number;
    const double now_mm_s = leg.base_insertion_mm() / std::max(leg.duration_s(), 1e-9);
    rate_mm_s += kGain * kNatural_rad_s * (now_mm_s - speed_mm_s);
    speed_mm_s = now_mm_s;
    constexpr int kSteps = 20;
    const double step_s = leg.duration_s() / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      rate_mm_s -= step_s * (2 * kDecay_per_s * rate_mm_s + kNatural_rad_s * kNatural_rad_s * z_mm);
      z_mm += step_s * rate_mm_s;
    }
  }
  void offset(model::Parameters /*p*/, const model::EffectMemory& memory, double /*time_s*/,
              model::Dual3& position_mm) const override {
    position_mm[2] += memory.number[0];
  }
};

TEST(Diagnose, WhatRingsOnAfterAChangeOfSpeedIsNoNoise) {
  const RingingStand stand;
  SimulatedRig rig{.effects = {{.effect = &stand, .parameters = {}}}, .frame_s = 1.0 / 30};
  const Findings found = findings_of(rig, 6);
  EXPECT_EQ(found.verdict, Verdict::unknown_effect) << found.sentence;
  EXPECT_THAT(found.effects, IsEmpty()) << found.sentence;
  ASSERT_FALSE(found.discrepancies.empty());
  const model::DiscrepancyCurve& curve = found.discrepancies[0].curve;
  EXPECT_EQ(curve.component, model::DiscrepancyComponent::z);
  EXPECT_EQ(curve.covariate, model::Covariate::since_speed_change_s);
  EXPECT_LT(found.held_out.after.rmse_mm, found.held_out.before.rmse_mm);
  // What the noise is without it.
  EXPECT_NEAR(found.noise.sigma[2] / rig.sigma_mm.z(), 1, 0.1);
}

TEST(Diagnose, IsTheSameForOneThreadAndTwo) {
  SimulatedRig rig = kWindup;
  rig.recordings = 3;
  rig.frame_s = 1.0 / 15;
  const Findings one = findings_of(rig, 3, 1), two = findings_of(rig, 3, 2);
  EXPECT_EQ(one.sentence, two.sentence);
  EXPECT_EQ(one.noise.sigma, two.noise.sigma);
  EXPECT_EQ(one.held_out.gain, two.held_out.gain);
  EXPECT_EQ(one.confusion, two.confusion);
  ASSERT_EQ(one.effects.size(), two.effects.size());
  for (std::size_t e = 0; e < one.effects.size(); ++e) {
    EXPECT_EQ(one.effects[e].name, two.effects[e].name);
    EXPECT_EQ(one.effects[e].probability, two.effects[e].probability);
    ASSERT_EQ(one.effects[e].parameters.size(), two.effects[e].parameters.size());
    for (std::size_t p = 0; p < one.effects[e].parameters.size(); ++p) {
      EXPECT_EQ(one.effects[e].parameters[p].value, two.effects[e].parameters[p].value);
      EXPECT_EQ(one.effects[e].parameters[p].ci95, two.effects[e].parameters[p].ci95);
    }
  }
  ASSERT_EQ(one.tried.size(), two.tried.size());
  for (std::size_t t = 0; t < one.tried.size(); ++t) {
    EXPECT_EQ(one.tried[t].name, two.tried[t].name);
    EXPECT_EQ(one.tried[t].log_bayes_factor, two.tried[t].log_bayes_factor);
  }
  ASSERT_EQ(one.detectable.size(), two.detectable.size());
  for (std::size_t d = 0; d < one.detectable.size(); ++d) EXPECT_EQ(one.detectable[d].size, two.detectable[d].size);
}

TEST(Diagnose, AModelThatCannotFollowIsRefused) {
  const auto recorded = record_case({.recordings = 2}, 1);
  model::NeedleParameters model = SimulatedRig{}.needle;
  model.lambda1_per_rad = 0.3;  // by (26) allowed, but these turns lead out of the domain
  model.lambda2 = 0.9;
  try {
    diagnose(recorded, model, {});
    FAIL() << "taken";
  } catch (const ArgumentError& e) {
    EXPECT_THAT(e.what(), HasSubstr("leaves the domain"));
  }
}

TEST(Diagnose, ReportsProgressAndStopsWhereProgressThrows) {
  const auto recorded = record_case({.recordings = 2, .frame_s = 0.1}, 1);
  DiagnosisOptions options;
  int stages = 0;
  options.progress = [&](const std::string&) {
    if (++stages == 2) throw std::runtime_error("stopped");
  };
  EXPECT_THROW(diagnose(recorded, SimulatedRig{}.needle, options), std::runtime_error);
  EXPECT_EQ(stages, 2);
}

}  // namespace
}  // namespace bevel::diagnosis::testing
