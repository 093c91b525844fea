// SPDX-License-Identifier: MIT
// What is drawn, and what of it gets onto the disk.
#include "proof/trial.hpp"

#include <gmock/gmock.h>

#include <map>
#include <nlohmann/json.hpp>

#include <bevel/io/model_file.hpp>
#include <bevel/io/recording.hpp>
#include "proof/score.hpp"
#include "proof/trial_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::proof {
namespace {

// First trial of the class, of seed 4.
int first_of(TrialClass wanted) {
  int number = 0;
  while (class_of(4, number) != wanted) ++number;
  return number;
}

TEST(Trial, EveryBlockHoldsThePublishedShares) {
  for (const std::uint64_t seed : {1U, 2U, 77U}) {
    std::map<TrialClass, int> count;
    for (int i = 0; i < 100; ++i) ++count[class_of(seed, i)];
    EXPECT_GE(count[TrialClass::nothing], 30);
    EXPECT_GE(count[TrialClass::unlisted], 15);
    EXPECT_EQ(count[TrialClass::two], 20);
    EXPECT_EQ(count[TrialClass::one], 100 - 20 - count[TrialClass::nothing] - count[TrialClass::unlisted]);
  }
}

TEST(Trial, IsTheSameForItsSeedAndNumber) {
  const int number = first_of(TrialClass::one);
  const Trial a = draw_trial(4, number);
  const Trial b = draw_trial(4, number);
  EXPECT_EQ(truth_json(a.truth), truth_json(b.truth));
  EXPECT_EQ(a.recordings[5].reported_mm, b.recordings[5].reported_mm);
  EXPECT_NE(truth_json(a.truth), truth_json(draw_trial(5, number).truth));
}

TEST(Trial, StatesWhatItConceals) {
  const Trial null = draw_trial(4, first_of(TrialClass::nothing));
  EXPECT_TRUE(draw_trial(4, first_of(TrialClass::two), {.nulls = true}).truth.entries.empty());
  EXPECT_TRUE(null.truth.expected().empty());
  EXPECT_EQ(null.truth.visible_sigmas, 0.0);
  EXPECT_LE(null.truth.ripple_sigmas, 1.0 + 1e-9);

  const Trial two = draw_trial(4, first_of(TrialClass::two));
  ASSERT_EQ(two.truth.entries.size(), 2U);
  EXPECT_NE(two.truth.entries[0].effect.name, two.truth.entries[1].effect.name);
  EXPECT_LE(two.truth.departure_sigmas, 3.0);

  const OpenedTruth opened = parse_truth(truth_json(two.truth));
  EXPECT_EQ(opened.expected, two.truth.expected());
  ASSERT_EQ(opened.effects.size(), 2U);
  EXPECT_EQ(opened.effects[0].visible_sigmas, two.truth.entries[0].visible_sigmas);
}

TEST(Trial, BetweenTwoGroupsOneThingChangesAtMost) {
  for (const int number : {first_of(TrialClass::two), first_of(TrialClass::unlisted), first_of(TrialClass::nothing)}) {
    const Trial trial = draw_trial(4, number, {.varied = 1.0, .two_groups = true});
    const Truth& truth = trial.truth;
    EXPECT_FALSE(truth.beam);
    ASSERT_EQ(truth.changed.size(), 8U);
    EXPECT_EQ(std::count(truth.changed.begin(), truth.changed.end(), true), 4);
    for (std::size_t i = 0; i < 4; ++i) {  // the same kinds of insertion, but not the same insertions
      EXPECT_EQ(truth.script_kinds[i], truth.script_kinds[i + 4]);
      EXPECT_NE(trial.recordings[i].motion.insertion_mm, trial.recordings[i + 4].motion.insertion_mm);
    }
    EXPECT_LE(truth.entries.size(), 1U);
    EXPECT_EQ(truth.trial_class == TrialClass::nothing, truth.entries.empty());
  }
}

TEST(Trial, AStiffShaftIsOnTheListFromTheThirdEditionOn) {
  constexpr int number = 6;  // a beam
  const Truth second = draw_trial(4, number, {.edition = 2}).truth;
  const Truth third = draw_trial(4, number).truth;
  ASSERT_TRUE(second.beam && third.beam);
  EXPECT_EQ(second.entries[0].effect.name, "unknown");
  EXPECT_EQ(third.entries[0].effect.name, "tip_swing");
  EXPECT_EQ(third.visible_sigmas, second.visible_sigmas);
  EXPECT_EQ(third.entries.size(), third.beam_config->relaxing_fraction > 0 ? 2U : 1U);
  EXPECT_TRUE(third.entries[0].nearest.contains("guide_mm"));
}

TEST(Trial, VariationIsDrawnBesideAndLeavesTheRestAsItWas) {
  const int number = first_of(TrialClass::nothing);
  const Trial plain = draw_trial(4, number), varied = draw_trial(4, number, {.varied = 1.0});
  EXPECT_FALSE(plain.truth.spread.any());
  ASSERT_TRUE(varied.truth.spread.any());
  ASSERT_EQ(varied.truth.variation.size(), varied.recordings.size());
  EXPECT_EQ(plain.truth.needle.curvature_per_mm, varied.truth.needle.curvature_per_mm);
  EXPECT_EQ(plain.recordings[3].frames.noise_mm, varied.recordings[3].frames.noise_mm);
  // Where the needle has hardly entered, registration is all the difference there is.
  for (std::size_t r = 0; r < varied.recordings.size(); ++r) {
    const Eigen::Vector3d shift = varied.recordings[r].reported_mm.col(0) - plain.recordings[r].reported_mm.col(0);
    EXPECT_NEAR(shift.x(), varied.truth.variation[r].entry_x_mm, 0.02);
    EXPECT_NEAR(shift.y(), varied.truth.variation[r].entry_y_mm, 0.02);
  }
  EXPECT_TRUE(varied.truth.expected().empty());
  EXPECT_NE(truth_json(varied.truth).find("variation"), std::string::npos);
  EXPECT_EQ(truth_json(plain.truth).find("variation"), std::string::npos);
}

TEST(Trial, WhatVariationExplainsIsLessVisible) {
  const int number = first_of(TrialClass::one);
  const Trial plain = draw_trial(4, number), varied = draw_trial(4, number, {.varied = 1.0});
  EXPECT_EQ(plain.truth.entries[0].effect.name, varied.truth.entries[0].effect.name);
  EXPECT_GT(varied.truth.entries[0].visible_sigmas, 0);
}

TEST(Absorber, TakesOutWhatTheDirectionsExplainByTheirSize) {
  Eigen::MatrixXd directions(5, 2);
  directions << 3, 0, 0, 0, 0, 0.5, 0, 0, 0, 0;
  const Absorber absorber(directions);
  // Against the definition: |a d|^2 = d' (I + U U')^-1 d.
  const Eigen::VectorXd d = (Eigen::VectorXd(5) << 1, -2, 0.3, 4, 0).finished();
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(5, 5) + directions * directions.transpose();
  EXPECT_NEAR(absorber(d).squaredNorm(), d.dot(covariance.ldlt().solve(d)), 1e-12);
  EXPECT_EQ(Absorber()(d), d);
}

TEST(Trial, AnEffectBelowTheLimitIsNotExpected) {
  Truth truth;
  truth.entries = {{{"layer", "", {}, {}}, 4.9}, {{"unknown", "screw", {}, {}}, 5.1}};
  EXPECT_THAT(truth.expected(), testing::ElementsAre("unknown"));
  EXPECT_THAT(truth.concealed(), testing::ElementsAre("layer", "unknown"));
}

TEST(Trial, TheLabsModelFileIsWrongButValidAndLogsAreWhole) {
  const test::TemporaryFolder out;
  const Trial trial = draw_trial(4, first_of(TrialClass::nothing));
  write_trial(out.path(), trial);
  const TrialFolders folders(out.path(), trial.truth.trial);

  const io::ModelFile model = io::load_model_file((folders.given / "model.toml").string());
  EXPECT_TRUE(model.effects.empty());
  EXPECT_NE(model.needle.curvature_per_mm, trial.truth.needle.curvature_per_mm);
  EXPECT_NEAR(model.needle.curvature_per_mm, trial.truth.needle.curvature_per_mm,
              0.11 * trial.truth.needle.curvature_per_mm);
  EXPECT_NEAR(model.needle.wheelbase_mm, trial.truth.needle.wheelbase_mm, 1e-3);

  for (std::size_t i = 0; i < trial.recordings.size(); ++i) {
    const auto recording = io::read_recording((folders.given / ("rec0" + std::to_string(i + 1) + ".lcm")).string());
    EXPECT_TRUE(recording.intact()) << recording.describe_faults();
    const double duration_s = trial.recordings[i].motion.duration_s();
    EXPECT_EQ(recording.tips.size(), trial.recordings[i].frames.size());
    EXPECT_NEAR(static_cast<double>(recording.tips.size()) / duration_s, 30, 3);
    EXPECT_NEAR(static_cast<double>(recording.actuators.size()) / duration_s, 50, 1);
    EXPECT_GT(recording.commands.size(), 10U);
    EXPECT_NEAR(recording.tips.front().position_mm.norm(), 0, 8.0);  // at the origin, but for noise or a wild value
    EXPECT_TRUE(recording.config.empty());
  }
}

TEST(Trial, NothingTheToolSeesHoldsTheTruth) {
  const test::TemporaryFolder out;
  const int number = first_of(TrialClass::one);
  const Trial trial = draw_trial(4, number);
  write_trial(out.path(), trial);
  const TrialFolders folders(out.path(), number);
  const std::string& name = trial.truth.entries[0].effect.name;
  for (const auto& entry : fs::directory_iterator(folders.given))
    EXPECT_EQ(read_text(entry.path()).find(name), std::string::npos) << entry.path();
  EXPECT_EQ(read_text(folders.commitment).find(name), std::string::npos);
  EXPECT_NE(open_truth(folders).find(name), std::string::npos);  // the search would find it
}

TEST(Trial, ATruthThatWasChangedDoesNotOpen) {
  const test::TemporaryFolder out;
  write_trial(out.path(), draw_trial(4, first_of(TrialClass::nothing)));
  const TrialFolders folders(out.path(), first_of(TrialClass::nothing));
  EXPECT_NO_THROW(open_truth(folders));
  nlohmann::json sealed = nlohmann::json::parse(read_text(folders.truth));
  std::string truth = sealed["truth"];
  truth.back() = ' ';
  sealed["truth"] = truth;
  write_atomically(folders.truth, sealed.dump());
  EXPECT_THAT([&] { open_truth(folders); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("commits to")));
}

TEST(Trial, TheDistributionIsDescribedInFull) {
  const std::string text = describe_distribution();
  for (const EffectKind& kind : catalogue()) EXPECT_THAT(text, testing::HasSubstr(kind.name));
}

}  // namespace
}  // namespace bevel::proof
