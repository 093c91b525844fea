// SPDX-License-Identifier: MIT
// Steered to targets with one model in the software and with another; and when that is not done.
#include <bevel/analysis/diagnose/steered.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/verdict_json.hpp>
#include "tests/diagnosis/made_up_findings.hpp"
#include "tests/needle/simulated_rig.hpp"

namespace bevel::analysis {
namespace {

using diagnosis::Findings;
using diagnosis::Verdict;
using ::testing::HasSubstr;

struct Steered : ::testing::Test {
  diagnosis::RecordedCase recorded = diagnosis::testing::record_case({.recordings = 2}, 3);
  io::ModelFile in_use{model::testing::agar()};
  Findings findings = diagnosis::testing::made_up(Verdict::effects_found);

  void SetUp() override {
    findings.steered.reset();
    findings.effects.pop_back();  // wind-up is left
  }
  Findings steered(int targets = 8, int threads = 2) const {
    Findings out = findings;
    steer_to_targets(recorded, in_use, model_of(findings, in_use), {targets, threads}, out);
    return out;
  }
};

TEST_F(Steered, WhoKnowsOfTheWindUpComesNearer) {
  const Findings f = steered();
  ASSERT_TRUE(f.steered) << f.not_steered;
  EXPECT_EQ(f.steered->targets, 8U);
  EXPECT_NEAR(f.steered->depth_mm[0], 0.9 * f.steered->depth_mm[1], 1e-9);
  EXPECT_GT(f.steered->depth_mm[1], 50);
  EXPECT_EQ(f.steered->as_it_stands.arrived, 8U);
  EXPECT_EQ(f.steered->found.arrived, 8U);
  EXPECT_LT(f.steered->found.median_mm, f.steered->as_it_stands.median_mm);
  EXPECT_LE(f.steered->found.median_mm, f.steered->found.worst_mm);
  EXPECT_TRUE(f.steered->not_known_live.empty());
}

TEST_F(Steered, TheSameModelTwiceIsTheSameWhateverTheThreads) {
  in_use = model_of(findings, in_use);
  findings.effects.clear();               // all of it was known
  findings.discrepancies.emplace_back();  // something that moves the tip has to be left to ask at all
  findings.discrepancies[0].moved_at_depth_mm = 1;
  findings.discrepancies[0].curve.at = {1, 0};  // which no model file may hold
  findings.discrepancies[0].curve.values = findings.discrepancies[0].curve.std_errors = {0, 0};
  ASSERT_FALSE(find_fault(findings.discrepancies[0].curve).empty());
  io::ModelFile found = model_of(findings, in_use);
  in_use.variation = found.variation;
  ASSERT_EQ(found, in_use);
  const Findings two = steered(3), one = steered(3, 1);
  ASSERT_TRUE(two.steered && one.steered);
  EXPECT_EQ(two.steered->as_it_stands.median_mm, two.steered->found.median_mm);
  EXPECT_EQ(two.steered->as_it_stands.worst_mm, two.steered->found.worst_mm);
  EXPECT_EQ(two.steered->found.worst_mm, one.steered->found.worst_mm);
}

TEST_F(Steered, AnInsertionThatStopsIsReportedWithQuantityValueLimitAndDepth) {
  findings.effects[0] = {};
  findings.effects[0].name = "insertion_scale";
  findings.effects[0].moved_at_depth_mm = 5;
  findings.effects[0].parameters = {{"ratio", 0.9}};
  const Findings f = steered(4);
  ASSERT_TRUE(f.steered) << f.not_steered;
  const auto& s = f.steered->as_it_stands;
  ASSERT_EQ(s.stopped.size(), 1U);
  EXPECT_EQ(s.arrived + s.stopped[0].count, 4U);
  EXPECT_EQ(s.stopped[0].reason, "needle state unhealthy, measurements rejected in a row");
  EXPECT_EQ(s.stopped_by, s.stopped[0].reason);
  EXPECT_GT(s.stopped[0].value[0], s.stopped[0].limit);
  EXPECT_GT(s.stopped[0].depth_mm[0], 0);
  EXPECT_THAT(steered_in_words(s, 4), HasSubstr("stopped by needle state unhealthy, measurements rejected in a row: "));
  EXPECT_THAT(steered_in_words(s, 4), HasSubstr(", limit 5, at a depth of "));
  EXPECT_EQ(steering_with(*f.steered), Steering::better);
}

TEST_F(Steered, ItIsSaidWhyNot) {
  const auto why_not = [&] {
    const Findings f = steered();
    EXPECT_FALSE(f.steered);
    return f.not_steered;
  };
  const Findings as_it_was = findings;
  findings.needle.curvature_sd_per_mm = 0.6 * findings.needle.value.curvature_per_mm;
  EXPECT_THAT(why_not(), HasSubstr("is not above zero with 95 %"));
  findings = as_it_was;
  in_use.needle.curvature_per_mm *= -1;
  EXPECT_THAT(why_not(), HasSubstr("k of the model file"));
  in_use.needle.curvature_per_mm *= -1;
  recorded.has_clock = false;
  EXPECT_EQ(why_not(), "the recordings have no clock");
  recorded.has_clock = true;
  for (auto& trace : findings.traces)
    for (auto& at : trace.covariates) {
      double& depth_mm = at[model::Covariate::depth_mm];
      depth_mm = std::min(depth_mm, 20.0);
    }
  EXPECT_EQ(why_not(), "the recordings reach 20 mm, and 30 are needed");
}

TEST_F(Steered, NothingIsSaidWhereThereIsNothingToSay) {
  const auto silent = [](const Findings& f) { return !f.steered && f.not_steered.empty(); };
  EXPECT_TRUE(silent(steered(0)));
  findings.effects[0].moved_at_depth_mm = 0;  // as an effect of headings alone
  EXPECT_TRUE(silent(steered()));
  findings.effects[0].moved_at_depth_mm = 1;
  findings.two_groups = true;
  EXPECT_TRUE(silent(steered()));
}

}  // namespace
}  // namespace bevel::analysis
