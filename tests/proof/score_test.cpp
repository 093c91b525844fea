// SPDX-License-Identifier: MIT
// Scores of verdicts made by hand.
#include "proof/score.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "proof/tally.hpp"

namespace bevel::proof {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::ThrowsMessage;

OpenedTruth truth_of(std::vector<OpenedEffect> effects) {
  OpenedTruth truth;
  truth.plant = "kinematic";
  truth.trial_class = "one";
  for (const auto& e : effects)
    if (e.visible_sigmas >= 5) truth.expected.push_back(e.name);
  std::sort(truth.expected.begin(), truth.expected.end());
  truth.effects = std::move(effects);
  return truth;
}

OpenedEffect windup(double sigmas = 20) { return {"torsional_windup", "", sigmas, {{"lag_at_100mm_rad", 0.6}}, {}}; }
OpenedEffect layer(double sigmas = 20) {
  return {"layer", "", sigmas, {{"depth_mm", 30}, {"curvature_ratio", 1.4}}, {}};
}
OpenedEffect screw(double sigmas = 20) { return {"unknown", "screw", sigmas, {}, {}}; }

json effect(const std::string& name, double probability = 0.9, const std::vector<std::string>& ambiguous = {},
            const json& parameters = json::object()) {
  return {{"name", name}, {"probability", probability}, {"ambiguous_with", ambiguous}, {"parameters", parameters}};
}

TrialScore score(const OpenedTruth& truth, const std::string& kind, const std::vector<json>& effects,
                 const json& more = {}) {
  json j{{"verdict", kind}, {"effects", effects}};
  if (more.is_object()) j.update(more);
  return score_verdict(truth, parse_verdict(j.dump()));
}

TEST(Score, ExactSetsOnly) {
  const OpenedTruth two = truth_of({windup(), layer()});
  EXPECT_TRUE(score(two, "effects-found", {effect("layer"), effect("torsional_windup")}).strict);
  EXPECT_FALSE(score(two, "effects-found", {effect("layer")}).strict);
  EXPECT_FALSE(score(two, "effects-found", {effect("layer"), effect("drilling")}).strict);
  EXPECT_FALSE(score(two, "effects-found", {effect("layer"), effect("torsional_windup"), effect("puncture")}).strict);
  EXPECT_FALSE(score(two, "unknown-effect", {effect("layer"), effect("torsional_windup")}).strict);
}

// A verdict that decides nothing is neither right nor an alarm.
TEST(Score, InconclusiveIsAnAbstention) {
  for (const OpenedTruth& truth : {truth_of({}), truth_of({windup()})}) {
    const TrialScore one = score(truth, "inconclusive", {});
    EXPECT_TRUE(one.abstained);
    EXPECT_EQ(one.abstention, "inconclusive");
    EXPECT_FALSE(one.strict);
    EXPECT_FALSE(one.lenient);
  }
  EXPECT_THROW(score(truth_of({}), "inconclusive", {effect("layer")}), std::runtime_error);
}

TEST(Score, NeedleCountsWhereAllThatWasConcealedIsNamed) {
  const auto with_needle = [](OpenedTruth truth) {
    truth.needle = {{"curvature_per_mm", 0.005}, {"lambda1_per_rad", 0.3}, {"lambda2", 0.1}};
    return truth;
  };
  const json found{{"needle",
                    {{"after",
                      {{"curvature_per_mm", {{"value", 0.0052}, {"std_error", 0.0001}}},
                       {"lambda1_per_rad", {{"value", 0.25}, {"std_error", 0.1}}},
                       {"lambda2", {{"value", 0.1}}},
                       {"wheelbase_mm", 20}}}}}};
  const TrialScore right = score(with_needle(truth_of({layer()})), "effects-found", {effect("layer")}, found);
  ASSERT_EQ(right.needle.size(), 3U);
  EXPECT_NEAR(*right.needle[0].z, 2, 1e-9);
  EXPECT_FALSE(*right.needle[0].covered);
  EXPECT_NEAR(*right.needle[1].z, -0.5, 1e-9);
  EXPECT_TRUE(*right.needle[1].covered);
  EXPECT_FALSE(right.needle[2].z);
  EXPECT_EQ(as_json(trial_score_of(as_json(right))), as_json(right));
  const Tally t = tally({right});
  EXPECT_EQ(t.needle_covered.of, 2);
  EXPECT_EQ(t.needle_covered.hits, 1);
  EXPECT_NEAR(t.z_needle_mean, 0.75, 1e-9);

  EXPECT_EQ(score(with_needle(truth_of({})), "nothing-missing", {}, found).needle.size(), 3U);
  // What is there and not named is in the needle.
  EXPECT_TRUE(score(with_needle(truth_of({layer(4)})), "nothing-missing", {}, found).needle.empty());
  EXPECT_TRUE(
      score(with_needle(truth_of({layer(), windup(3)})), "effects-found", {effect("layer")}, found).needle.empty());
  EXPECT_TRUE(score(with_needle(truth_of({screw()})), "unknown-effect", {}, found).needle.empty());
  OpenedTruth beam = with_needle(truth_of({layer()}));
  beam.plant = "beam";
  EXPECT_TRUE(score(beam, "effects-found", {effect("layer")}, found).needle.empty());
}

TEST(Score, OfTwoGroupsTheChangeIsWhatCounts) {
  const OpenedTruth one = truth_of({layer()});
  const auto of_groups = [&](const std::string& kind, const std::vector<json>& changes) {
    return score_verdict(
        one, parse_verdict(json{{"verdict", kind}, {"effects", json::array()}, {"changes", changes}}.dump()));
  };
  EXPECT_TRUE(of_groups("changed", {effect("layer")}).strict);
  EXPECT_FALSE(of_groups("changed", {effect("curvature_per_mm")}).strict);
  EXPECT_FALSE(of_groups("changed-unknown", {effect("layer")}).strict);
  EXPECT_FALSE(of_groups("unchanged", {}).strict);
  EXPECT_THROW(of_groups("unchanged", {effect("layer")}), std::runtime_error);
}

TEST(Score, AmbiguousCountsApart) {
  const OpenedTruth one = truth_of({windup()});
  const TrialScore s = score(one, "effects-found", {effect("rotation_backlash", 0.6, {"torsional_windup"})});
  EXPECT_FALSE(s.strict);
  EXPECT_TRUE(s.lenient);
  EXPECT_EQ(s.probability_of_truth, 0.0);
  // One name cannot stand for two truths, nor two names for one.
  const OpenedTruth two = truth_of({windup(), layer()});
  EXPECT_FALSE(score(two, "effects-found", {effect("drilling", 0.9, {"torsional_windup", "layer"})}).lenient);
  EXPECT_FALSE(score(one, "effects-found",
                     {effect("drilling", 0.9, {"torsional_windup"}), effect("layer", 0.9, {"torsional_windup"})})
                   .lenient);
  EXPECT_TRUE(
      score(two, "effects-found",
            {effect("depth_dependence", 0.5, {"layer"}), effect("rotation_backlash", 0.5, {"torsional_windup"})})
          .lenient);
}

// "Below that nothing-missing counts as right too": so does the name of what is concealed, and nothing else.
TEST(Score, BelowTheLimitSilenceIsRightToo) {
  const OpenedTruth small = truth_of({windup(3)});
  EXPECT_EQ(score(small, "nothing-missing", {}).visibility, Visibility::invisible);
  EXPECT_TRUE(score(small, "nothing-missing", {}).strict);
  EXPECT_TRUE(score(small, "effects-found", {effect("torsional_windup")}).strict);
  EXPECT_FALSE(score(small, "effects-found", {effect("rotation_backlash")}).strict);
  EXPECT_FALSE(score(small, "effects-found", {effect("torsional_windup"), effect("layer")}).strict);
  EXPECT_FALSE(score(small, "unknown-effect", {effect("torsional_windup")}).strict);
  const OpenedTruth one_of_two = truth_of({windup(3), layer(30)});
  EXPECT_EQ(score(one_of_two, "effects-found", {effect("layer")}).visibility, Visibility::partly);
  EXPECT_TRUE(score(one_of_two, "effects-found", {effect("layer")}).strict);
  EXPECT_TRUE(score(one_of_two, "effects-found", {effect("layer"), effect("torsional_windup")}).strict);
  EXPECT_FALSE(score(one_of_two, "effects-found", {effect("torsional_windup")}).strict);
  EXPECT_EQ(tally({score(one_of_two, "effects-found", {effect("layer"), effect("torsional_windup")})})
                .confusion.count(kBeyond),
            0U);
}

TEST(Score, UnknownEffects) {
  const OpenedTruth unlisted = truth_of({screw()});
  EXPECT_TRUE(score(unlisted, "unknown-effect", {}).strict);
  EXPECT_EQ(score(unlisted, "unknown-effect", {}).probability_of_truth, 1.0);
  EXPECT_FALSE(score(unlisted, "unknown-effect", {effect("layer")}).strict);
  EXPECT_FALSE(score(unlisted, "effects-found", {effect("insertion_scale")}).strict);
  EXPECT_FALSE(score(unlisted, "effects-found", {effect("insertion_scale", 0.5, {"unknown"})}).lenient);
  const OpenedTruth both = truth_of({screw(), layer()});
  EXPECT_TRUE(score(both, "unknown-effect", {effect("layer")}).strict);
  EXPECT_FALSE(score(both, "unknown-effect", {}).strict);
  EXPECT_FALSE(score(truth_of({}), "unknown-effect", {}).strict);
}

// What no tool could know better counts apart, and only if nothing else was said.
TEST(Score, ARivalOfAnUnlistedEffect) {
  OpenedTruth unlisted = truth_of({screw()});
  unlisted.rivals = {"camera_latency"};
  const TrialScore s = score(unlisted, "effects-found", {effect("camera_latency")});
  EXPECT_FALSE(s.strict);
  EXPECT_TRUE(s.lenient);
  EXPECT_FALSE(score(unlisted, "effects-found", {effect("layer")}).lenient);
  EXPECT_FALSE(score(unlisted, "effects-found", {effect("camera_latency"), effect("layer")}).lenient);
  EXPECT_FALSE(score(unlisted, "nothing-missing", {}).lenient);
  EXPECT_EQ(tally({s}).unknown_called_unknown.of, 1);
  EXPECT_EQ(tally({s}).unknown_distinct.of, 0);
}

// With a wide spread between insertions a model that predicts better need not be nearer.
TEST(Score, HeldOutByDensityAndByError) {
  const auto fit = [](double rmse_mm, double log_density) {
    return nlohmann::json{{"rmse_mm", rmse_mm}, {"log_density", log_density}};
  };
  const nlohmann::json fits{{"fit", {{"before", fit(0.5, -0.13)}, {"after", fit(0.6, -0.12)}}}};
  const TrialScore s = score(truth_of({screw()}), "unknown-effect", {}, fits);
  const Tally t = tally({s});
  EXPECT_EQ(t.unknown_likelier.of, 1);
  EXPECT_EQ(t.unknown_likelier.hits, 1);
  EXPECT_EQ(t.unknown_nearer.of, 1);
  EXPECT_EQ(t.unknown_nearer.hits, 0);
  EXPECT_EQ(tally({score(truth_of({layer()}), "effects-found", {effect("layer")}, fits)}).unknown_likelier.of, 0);
  EXPECT_EQ(as_json(trial_score_of(as_json(s))), as_json(s));
}

TEST(Score, ProbabilityOfTheTruth) {
  const OpenedTruth one = truth_of({windup()});
  EXPECT_NEAR(score(one, "effects-found", {effect("torsional_windup", 0.8)}).probability_of_truth, 0.8, 1e-12);
  EXPECT_NEAR(score(one, "effects-found", {effect("torsional_windup", 0.8), effect("layer", 0.7)}).probability_of_truth,
              0.8 * 0.3, 1e-12);
  EXPECT_EQ(score(one, "nothing-missing", {}).probability_of_truth, 0.0);
  EXPECT_EQ(score(truth_of({}), "nothing-missing", {}).probability_of_truth, 1.0);
}

// By the sets that a verdict lists: what was not named has its probability too.
TEST(Score, ProbabilityByTheSetsOfThePosterior) {
  const json posterior{{"posterior",
                        {{"nothing_missing", 0.1},
                         {"discrepancy", 0.15},
                         {"explanations",
                          {{{"effects", {"lost_steps (rotation)"}}, {"probability", 0.6}, {"with_discrepancy", 0.2}},
                           {{"effects", {"torsional_windup"}}, {"probability", 0.25}, {"with_discrepancy", 0.1}},
                           {{"effects", json::array()}, {"probability", 0.15}, {"with_discrepancy", 0.0}}}}}}};
  const TrialScore s = score(truth_of({windup()}), "effects-found", {effect("lost_steps", 0.6)}, posterior);
  // Half of what lies beside a discrepancy is beside one that counts.
  EXPECT_NEAR(s.probability_of_truth, 0.25 - 0.5 * 0.1, 1e-12);
  EXPECT_NEAR(s.probability_of_said, 0.6 - 0.5 * 0.2, 1e-12);
  EXPECT_NEAR(score(truth_of({}), "effects-found", {effect("lost_steps")}, posterior).probability_of_truth, 0.1, 1e-12);
  EXPECT_NEAR(score(truth_of({windup(), screw()}), "unknown-effect", {effect("torsional_windup")}, posterior)
                  .probability_of_truth,
              0.5 * 0.1, 1e-12);
}

json estimate(double value, double std_error) {
  return {{"value", value}, {"std_error", std_error}, {"ci95", {value - 2 * std_error, value + 2 * std_error}}};
}

TEST(Score, ParametersInTheirOwnErrors) {
  const TrialScore s = score(truth_of({windup()}), "effects-found",
                             {effect("torsional_windup", 1, {}, {{"lag_at_100mm_rad", estimate(0.66, 0.02)}})});
  ASSERT_EQ(s.parameters.size(), 1U);
  EXPECT_NEAR(*s.parameters[0].z, 3.0, 1e-9);
  EXPECT_FALSE(*s.parameters[0].covered);
  // Of an effect that could not be seen, or was named wrongly, nothing is scored.
  EXPECT_TRUE(score(truth_of({windup(2)}), "effects-found",
                    {effect("torsional_windup", 1, {}, {{"lag_at_100mm_rad", estimate(0.66, 0.02)}})})
                  .parameters.empty());
}

TEST(Score, ADirectionIsALine) {
  OpenedEffect motion{"tissue_motion", "", 50, {{"direction_rad", 0.05}}, {}};
  const TrialScore s = score(truth_of({motion}), "effects-found",
                             {effect("tissue_motion", 1, {}, {{"direction_rad", estimate(3.1316, 0.05)}})});
  EXPECT_NEAR(*s.parameters[0].z, (3.1316 - 3.14159265 - 0.05) / 0.05, 1e-4);
  EXPECT_TRUE(*s.parameters[0].covered);
}

TEST(Score, Places) {
  OpenedEffect lost{"lost_steps", "", 50, {{"rotation_rad", 0.8}}, {0, 0, 2.5, 0, 4.0, 0, 0, 0}};
  const json where = {{"where", {{{"log", "/case/rec03.lcm"}, {"channel", "tip.x"}, {"from_s", 2.58}, {"to_s", 9.0}}}}};
  const TrialScore by_span = score(truth_of({lost}), "effects-found", {effect("lost_steps")}, where);
  ASSERT_EQ(by_span.locations.size(), 1U);  // of rec05 nothing is said
  EXPECT_NEAR(by_span.locations[0].error, 0.08, 1e-9);
  EXPECT_TRUE(by_span.locations[0].in_seconds);
  const json at = {{"at_s", {{"rec03.lcm", 2.51}, {"rec05.lcm", {{"value", 4.3}, {"std_error", 0.1}}}}}};
  const TrialScore by_value = score(truth_of({lost}), "effects-found", {effect("lost_steps", 1, {}, at)}, where);
  ASSERT_EQ(by_value.locations.size(), 2U);
  EXPECT_NEAR(by_value.locations[0].error, 0.01, 1e-9);
  EXPECT_NEAR(by_value.locations[1].error, 0.3, 1e-9);
  const TrialScore depth =
      score(truth_of({layer()}), "effects-found", {effect("layer", 1, {}, {{"depth_mm", estimate(28.5, 1)}})});
  ASSERT_EQ(depth.locations.size(), 1U);
  EXPECT_NEAR(depth.locations[0].error, 1.5, 1e-9);
  EXPECT_FALSE(depth.locations[0].in_seconds);
}

struct Bad {
  const char* text;
  const char* complaint;
};
class BadVerdict : public testing::TestWithParam<Bad> {};
TEST_P(BadVerdict, IsRefusedWithAReason) {
  EXPECT_THAT([] { parse_verdict(GetParam().text); },
              ThrowsMessage<std::runtime_error>(HasSubstr(GetParam().complaint)));
}
INSTANTIATE_TEST_SUITE_P(
    All, BadVerdict,
    testing::Values(Bad{"", "not a JSON object"}, Bad{"[1, 2]", "not a JSON object"}, Bad{"{", "not a JSON object"},
                    Bad{R"({"effects": []})", "allowed are"}, Bad{R"({"verdict": "maybe"})", "maybe"},
                    Bad{R"({"verdict": 3})", "not a string"},
                    Bad{R"({"verdict": "effects-found", "effects": []})", "none is named"},
                    Bad{R"({"verdict": "nothing-missing", "effects": [{"name": "layer"}]})", "effects are named"},
                    Bad{R"({"verdict": "effects-found", "effects": [{}]})", "no name"},
                    Bad{R"({"verdict": "effects-found", "effects": {"name": "layer"}})", "not a list"},
                    Bad{R"({"verdict": "effects-found", "effects": [{"name": "layer", "probability": 1.5}]})", "1.5"},
                    Bad{R"({"verdict": "effects-found", "effects": [{"name": "layer", "probability": "high"}]})",
                        "not a number"},
                    Bad{R"({"verdict": "effects-found", "effects": [{"name": "layer", "parameters":
                        {"depth_mm": {"value": null}}}]})",
                        "no value"}));

TEST(Score, ComesBackFromJson) {
  TrialScore s = score(truth_of({windup(), screw(), layer(2)}), "unknown-effect",
                       {effect("torsional_windup", 0.8, {}, {{"lag_at_100mm_rad", estimate(0.61, 0.02)}})},
                       {{"fit", {{"before", {{"chi2_per_dof", 15.2}}}, {"after", {{"chi2_per_dof", 1.02}}}}}});
  s.seconds = 12.5;
  EXPECT_EQ(as_json(trial_score_of(as_json(s))), as_json(s));
  EXPECT_EQ(*s.chi2_before, 15.2);
  EXPECT_EQ(*s.chi2_after, 1.02);
}

}  // namespace
}  // namespace bevel::proof
