// SPDX-License-Identifier: MIT
#include "proof/tally.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "proof/page.hpp"

namespace bevel::proof {
namespace {

using testing::HasSubstr;

// Wilson 1927; Brown, Cai and DasGupta 2001, Statistical Science 16.
TEST(Intervals, KnownValues) {
  const Interval w = wilson95({8, 10});
  EXPECT_NEAR(w.low, 0.4902, 5e-4);
  EXPECT_NEAR(w.high, 0.9433, 5e-4);
  EXPECT_NEAR(wilson95({0, 10}).high, 0.2775, 5e-4);
  EXPECT_EQ(wilson95({0, 0}).high, 1.0);
  const Interval exact = clopper_pearson95({8, 10});
  EXPECT_NEAR(exact.low, 0.4439, 5e-4);
  EXPECT_NEAR(exact.high, 0.9748, 5e-4);
  EXPECT_EQ(clopper_pearson95({10, 10}).high, 1.0);
}

// No false alarm in 59 is the least that bounds the rate below 5 %.
TEST(Intervals, FiftyNineNulls) {
  EXPECT_LT(clopper_pearson_upper95({0, 59}), 0.05);
  EXPECT_GT(clopper_pearson_upper95({0, 58}), 0.05);
  EXPECT_EQ(clopper_pearson_upper95({0, 0}), 1.0);
}

TrialScore trial(const std::vector<std::string>& expected, const std::vector<std::string>& named, double sigmas = 20) {
  TrialScore s;
  s.expected = expected;
  s.named = named;
  s.strict = s.lenient = expected == named;
  s.visible_sigmas = expected.empty() ? 0 : sigmas;
  s.visibility = expected.empty() ? Visibility::null : Visibility::visible;
  s.trial_class = expected.empty() ? "nothing" : "one";
  s.plant = "kinematic";
  s.concealed = expected;
  for (const auto& name : expected)
    s.found.push_back({name, sigmas, std::find(named.begin(), named.end(), name) != named.end()});
  s.probability_of_truth = s.strict ? 1 : 0;
  s.seconds = 3;
  return s;
}

TEST(Tally, ConfusionCountsEachExpectedEffectOnce) {
  const Tally t =
      tally({trial({}, {}), trial({}, {"layer"}), trial({"layer"}, {"layer"}), trial({"layer"}, {}),
             trial({"layer", "puncture"}, {"drilling", "puncture"}), trial({"unknown"}, {"insertion_scale", "layer"})});
  EXPECT_EQ(t.confusion.at("none").at("none"), 1);
  EXPECT_EQ(t.confusion.at("none").at("layer"), 1);   // the false alarm, and no more of them than the page counts
  EXPECT_EQ(t.confusion.at(kBeyond).at("layer"), 1);  // the second name for the unknown
  EXPECT_EQ(t.confusion.at("layer").at("layer"), 1);
  EXPECT_EQ(t.confusion.at("layer").at("none"), 1);
  EXPECT_EQ(t.confusion.at("layer").at("drilling"), 1);
  EXPECT_EQ(t.confusion.at("puncture").at("puncture"), 1);
  EXPECT_EQ(t.confusion.at("unknown").at("insertion_scale"), 1);
}

// Four verdicts that claim 0.95, of which three are right, and one of 0.6 that is: 0.8 |0.95 - 0.75| + 0.2 |0.6 - 1|.
TEST(Tally, ReliabilityComparesProbabilitiesWithShares) {
  std::vector<TrialScore> scores(5, trial({"layer"}, {"layer"}));
  scores[0] = trial({"layer"}, {"drilling"});
  for (auto& one : scores) one.probability_of_said = 0.95;
  scores[4].probability_of_said = 0.6;
  const Tally t = tally(scores);
  EXPECT_NEAR(t.expected_calibration_error, 0.8 * 0.2 + 0.2 * 0.4, 1e-12);
  EXPECT_EQ(t.truth_improbable.hits, 1);
  EXPECT_EQ(t.reliability.at(3).right.of, 4);
  EXPECT_NEAR(t.reliability.at(3).mean, 0.95, 1e-12);
}

TEST(Tally, SharesByVisibility) {
  TrialScore silent = trial({"layer"}, {});
  silent.abstained = true;
  const Tally t = tally({trial({}, {}), trial({}, {"layer"}), trial({"layer"}, {"layer"}), silent,
                         trial({"unknown"}, {"unknown"}), trial({"unknown"}, {"layer"})});
  EXPECT_EQ(t.strict.at("visible").hits, 2);
  EXPECT_EQ(t.strict.at("visible").of, 4);  // the abstention counts, as wrong
  EXPECT_EQ(t.strict.at("all").of, 6);
  EXPECT_EQ(t.abstentions, 1);
  EXPECT_EQ(t.false_alarms.hits, 1);
  EXPECT_EQ(t.false_alarms.of, 2);
  EXPECT_EQ(t.unknown_called_unknown.hits, 1);
  EXPECT_EQ(t.unknown_called_unknown.of, 2);
}

TEST(Tally, ZScores) {
  TrialScore s = trial({"layer"}, {"layer"});
  for (const double z : {-1.0, 0.0, 1.0, 2.0}) s.parameters.push_back({"layer", "depth_mm", 30, 30, z, z < 1.5});
  s.parameters.push_back({"layer", "curvature_ratio", 1.4, 1.4, {}, {}});  // without errors: not counted
  const Tally t = tally({s});
  EXPECT_EQ(t.z.size(), 4U);
  EXPECT_NEAR(t.z_mean, 0.5, 1e-12);
  EXPECT_NEAR(t.z_spread, 1.29099, 1e-4);
  EXPECT_EQ(t.covered.hits, 3);
  EXPECT_EQ(t.covered.of, 4);
}

TEST(Tally, SensitivityBinsByVisibleSize) {
  const Tally t = tally({trial({"layer"}, {"layer"}, 6), trial({"layer"}, {}, 7), trial({"layer"}, {"layer"}, 500)});
  for (const SensitivityBin& bin : t.sensitivity) {
    if (bin.low_sigmas == 5) {
      EXPECT_EQ(bin.named.hits, 1);
      EXPECT_EQ(bin.named.of, 2);
    }
    if (bin.high_sigmas == std::numeric_limits<double>::infinity()) {
      EXPECT_EQ(bin.named.hits, 1);
    }
  }
}

TEST(Page, SaysTheMainFiguresAndEveryTrial) {
  const std::vector<TrialScore> scores{trial({}, {}), trial({"layer"}, {"drilling"}), trial({"unknown"}, {"unknown"})};
  const std::string page = results_page({7, true, "aa", "bb", "cc"}, tally(scores), scores);
  EXPECT_THAT(page, HasSubstr("1 of 2 trials"));
  EXPECT_THAT(page, HasSubstr("t0000"));
  EXPECT_THAT(page, HasSubstr("drilling"));
  EXPECT_THAT(page, testing::Not(HasSubstr("http://www.w3.org/1999/xhtml\" src")));
  EXPECT_THAT(page, testing::Not(HasSubstr("ran WITHOUT")));
  EXPECT_THAT(results_page({7, false, "", "", ""}, tally(scores), scores), HasSubstr("ran WITHOUT"));
}

TEST(Page, SaysWhereTheMiddleOfTheParametersIsWhateverTheFarthestDoes) {
  TrialScore s = trial({"layer"}, {"layer"});
  for (const double z : {2000.0, -1.0, 0.2, 1.0, 0.0})
    s.parameters.push_back({"layer", "depth_mm", 30, 30, z, z < 1.5});
  const std::vector<TrialScore> scores{s, trial({}, {"layer"})};
  const std::string page = results_page({7, true, "aa", "bb", "cc"}, tally(scores), scores);
  EXPECT_THAT(page, HasSubstr("5 parameters: median 0.2, half of them from 0 to 1, the farthest off by 2000 standard"));
  EXPECT_THAT(page, HasSubstr("1 false alarm in 1 trial"));
}

TEST(Page, StandsWithNoTrialsOfAKind) {
  const std::vector<TrialScore> scores{trial({}, {})};
  EXPECT_THAT(results_page({}, tally(scores), scores), HasSubstr("no trials"));
}

}  // namespace
}  // namespace bevel::proof
