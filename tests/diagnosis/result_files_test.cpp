// SPDX-License-Identifier: MIT
// Results: what is in them, all of them or none, and the schema.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include <bevel/analysis/diagnose/diagnose_tool.hpp>
#include <bevel/analysis/diagnose/report.hpp>
#include <bevel/analysis/diagnose/verdict_json.hpp>
#include "tests/diagnosis/made_up_findings.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;
using diagnosis::Verdict;
using diagnosis::testing::made_up;
using test::text_of;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

struct Results : ::testing::Test {
  test::TemporaryFolder folder;

  std::vector<std::string> names_in(const fs::path& where) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(where)) names.push_back(entry.path().filename().string());
    return names;
  }
};

TEST_F(Results, VerdictsFollowTheSchema) {
  const std::string validate = "python3 -c 'import jsonschema' 2>/dev/null";
  if (std::system(validate.c_str()) != 0) GTEST_SKIP() << "no python3-jsonschema (tools/setup installs it)";
  auto odd = made_up(Verdict::nothing_missing);
  odd.held_out.before.chi2_per_dof = std::numeric_limits<double>::infinity();
  odd.noise.sigma = {};
  write_together(folder.path(), {{"found.json", verdict_json(made_up(Verdict::effects_found))},
                                 {"nothing.json", verdict_json(made_up(Verdict::nothing_missing))},
                                 {"unknown.json", verdict_json(made_up(Verdict::unknown_effect))},
                                 {"odd.json", verdict_json(odd)}});
  const std::string check = std::string("python3 ") + BEVEL_SOURCE_DIR + "/tests/diagnosis/validate_verdict.py ";
  for (const char* name : {"found", "nothing", "unknown", "odd"})
    EXPECT_EQ(std::system((check + (folder / name).string() + ".json").c_str()), 0) << name;
  // A schema that lets everything pass would prove nothing.
  auto broken = nlohmann::json::parse(text_of(folder / "found.json"));
  broken["effects"][0].erase("probability");
  std::ofstream(folder / "broken.json") << broken;
  EXPECT_NE(std::system((check + (folder / "broken.json").string() + " 2>/dev/null").c_str()), 0);
  broken = nlohmann::json::parse(text_of(folder / "found.json"));
  broken["insertions"]["rec01.lcm"]["roll_rad"].erase("std_error");
  std::ofstream(folder / "broken.json") << broken;
  EXPECT_NE(std::system((check + (folder / "broken.json").string() + " 2>/dev/null").c_str()), 0);
  broken = nlohmann::json::parse(text_of(folder / "found.json"));
  broken["fit"]["predicted"]["after"]["beyond_first_third"]["continued"]["share_in_95"] = 1.1;
  std::ofstream(folder / "broken.json") << broken;
  EXPECT_NE(std::system((check + (folder / "broken.json").string() + " 2>/dev/null").c_str()), 0);
  broken = nlohmann::json::parse(text_of(folder / "found.json"));
  broken["steered"]["found"].erase("arrived");
  std::ofstream(folder / "broken.json") << broken;
  EXPECT_NE(std::system((check + (folder / "broken.json").string() + " 2>/dev/null").c_str()), 0);
  broken = nlohmann::json::parse(text_of(folder / "found.json"));
  broken["proposed_effect"] = {{"name", "of"}, {"file", "another verdict"}};
  std::ofstream(folder / "broken.json") << broken;
  EXPECT_NE(std::system((check + (folder / "broken.json").string() + " 2>/dev/null").c_str()), 0);
}

TEST_F(Results, TheVerdictSaysWhatWasFound) {
  const auto j = nlohmann::json::parse(verdict_json(made_up(Verdict::effects_found)));
  EXPECT_EQ(j["verdict"], "effects-found");
  EXPECT_EQ(j["effects"][0]["name"], "torsional_windup");
  EXPECT_EQ(j["effects"][0]["ambiguous_with"][0], "rotation_backlash");
  EXPECT_DOUBLE_EQ(j["effects"][0]["parameters"]["lag_at_100mm_rad"]["value"], 0.8234);
  EXPECT_DOUBLE_EQ(j["effects"][1]["recordings"]["rec03.lcm"]["at_s"]["value"], 3.309);
  EXPECT_EQ(j["where"][0]["range"][1], 52);
  EXPECT_EQ(j["fit"]["held_out"], "leave-one-recording-out");
  EXPECT_DOUBLE_EQ(j["effects"][0]["moved_at_depth_mm"], 1.83);
  EXPECT_TRUE(j["effects"][1]["moved_at_depth_mm"].is_null());
  EXPECT_EQ(j["steered"]["as_it_stands"]["arrived"], 7);
  EXPECT_DOUBLE_EQ(j["steered"]["found"]["median_mm"], 0.052);
  EXPECT_TRUE(nlohmann::json::parse(verdict_json(made_up(Verdict::nothing_missing)))["steered"].is_null());
  EXPECT_EQ(nlohmann::json::parse(verdict_json(made_up(Verdict::unknown_effect)))["steered"]["why_not"],
            "the recordings have no clock");
  EXPECT_DOUBLE_EQ(j["fit"]["after"]["chi2_per_dof"], 1.012);
  const auto& after = j["fit"]["predicted"]["after"];
  EXPECT_DOUBLE_EQ(after["new_insertion"]["share_in_95"], 0.951);
  EXPECT_DOUBLE_EQ(after["beyond_first_third"]["continued"]["channels"]["tip.y"]["rmse"], 0.9 * 0.4 * 0.264);
  EXPECT_DOUBLE_EQ(j["fit"]["recordings"]["rec02.lcm"]["predicted"]["before"]["new_insertion"]["rmse_mm"], 0.91);
  EXPECT_DOUBLE_EQ(j["insertions"]["rec02.lcm"]["tilt_x_rad"]["value"], 0.003 * std::sin(3));
  EXPECT_DOUBLE_EQ(j["insertions"]["rec02.lcm"]["tilt_x_rad"]["std_error"], 0.4 * 0.003);
  EXPECT_TRUE(j["detectable"]["layer"]["curvature_ratio"].is_null());  // infinite
}

// A verdict of 99 % requires no experiment; for an inconclusive one, no motion may separate the explanations.
TEST_F(Results, TheNextExperimentIsNoneNeededWhereThereIsNoDoubt) {
  const auto next = [](const diagnosis::Findings& f) {
    return nlohmann::json::parse(verdict_json(f))["next_experiment"];
  };
  diagnosis::Findings f = made_up(Verdict::effects_found);
  f.probability = 0.98;
  EXPECT_TRUE(next(f).is_object());
  f.probability = 0.99;
  EXPECT_EQ(next(f), "none needed");
  EXPECT_EQ(next(made_up(Verdict::nothing_missing)), "none needed");
  EXPECT_TRUE(next(made_up(Verdict::inconclusive)).is_null());
}

TEST_F(Results, AnInconclusiveVerdictNamesNothingAndSaysWhy) {
  const auto j = nlohmann::json::parse(verdict_json(made_up(Verdict::inconclusive)));
  EXPECT_EQ(j["verdict"], "inconclusive");
  EXPECT_TRUE(j["effects"].empty());
  EXPECT_THAT(j["reasons"][0].get<std::string>(), ::testing::HasSubstr("not fitted"));
  diagnosis::Findings changed = made_up(Verdict::inconclusive);
  changed.two_groups = true;
  EXPECT_EQ(nlohmann::json::parse(verdict_json(changed))["verdict"], "inconclusive");
}

// A log Bayes factor that was not computed is null.
TEST_F(Results, ALogBayesFactorThatWasNotComputedIsNull) {
  diagnosis::Findings f = made_up(Verdict::effects_found);
  f.tried.front().log_bayes_factor.reset();
  EXPECT_TRUE(nlohmann::json::parse(verdict_json(f))["tried"][0]["log_bayes_factor"].is_null());
  EXPECT_THAT(report_html(f, {}), ::testing::HasSubstr("not computed"));
}

TEST_F(Results, TheModelReadsBackWithItsUnknownsOfSingleRecordings) {
  const auto model = model_of(made_up(Verdict::effects_found));
  const auto again = io::parse_model_file(io::to_toml(model), "model.toml");
  EXPECT_EQ(again, model);
  ASSERT_EQ(again.effects.size(), 2U);
  EXPECT_DOUBLE_EQ(again.effects[1].recordings.at("rec04.lcm").at("at_s"), 2.411);
  // The unknown part has no name.
  EXPECT_EQ(model_of(made_up(Verdict::unknown_effect)).effects.size(), 1U);
}

TEST_F(Results, TakeThePlaceOfOlderOnesTogether) {
  write_together(folder / "new" / "deep", {{"a", "1"}, {"b", "2"}});
  write_together(folder / "new" / "deep", {{"a", "3"}, {"b", "4"}});
  EXPECT_THAT(names_in(folder / "new" / "deep"), UnorderedElementsAre("a", "b"));
  EXPECT_EQ(text_of(folder / "new" / "deep" / "b"), "4");
}

TEST_F(Results, NoneIsTouchedIfOneCannotBe) {
  write_together(folder.path(), {{"a", "old"}, {"b", "old"}});
  fs::create_directories(folder / "c" / "full");
  EXPECT_THROW(write_together(folder.path(), {{"a", "new"}, {"c", "new"}, {"b", "new"}}), std::runtime_error);
  EXPECT_EQ(text_of(folder / "a"), "old");
  EXPECT_EQ(text_of(folder / "b"), "old");
  EXPECT_THAT(names_in(folder.path()), UnorderedElementsAre("a", "b", "c"));
}

// A file that these results do not have must not stand there as if it were of them.
TEST_F(Results, WhatTheyDoNotHaveIsTakenAwayWithTheOlderOnes) {
  write_together(folder.path(), {{"a", "old"}, {"sometimes", "old"}, {"b", "old"}});
  fs::create_directories(folder / "c" / "full");
  EXPECT_THROW(write_together(folder.path(), {{"c", "new"}, {"sometimes", {}}, {"b", "new"}}), std::runtime_error);
  EXPECT_THAT(names_in(folder.path()), UnorderedElementsAre("a", "b", "c", "sometimes"));
  EXPECT_THROW(write_together(folder.path(), {{"a", "new"}, {"c", {}}, {"b", "new"}}), std::runtime_error);
  EXPECT_EQ(text_of(folder / "a"), "old");
  fs::remove_all(folder / "c");
  write_together(folder.path(), {{"a", "new"}, {"sometimes", {}}, {"b", "new"}});
  EXPECT_THAT(names_in(folder.path()), UnorderedElementsAre("a", "b"));
  write_together(folder.path(), {{"a", "new"}, {"sometimes", {}}, {"b", "new"}});  // where there is none
  EXPECT_THAT(names_in(folder.path()), UnorderedElementsAre("a", "b"));
}

// Silence beside residuals that are no noise must not pass for a clean bill of health.
TEST(PrintedVerdict, WhatIsLeftIsSaidWhereItIsNoNoise) {
  auto findings = made_up(Verdict::nothing_missing);
  const auto said = [&] {
    std::ostringstream out;
    print_verdict(out, findings);
    return out.str();
  };
  findings.checks = {.chi2_per_dof = 1, .band = {0.92, 1.08}, .ljung_box_p = 0.5, .clean = true};
  EXPECT_THAT(said(), ::testing::Not(HasSubstr("What is left")));
  findings.checks.ljung_box_p = 1e-9;
  findings.checks.clean = false;
  EXPECT_THAT(said(), HasSubstr("What is left is correlated from reading to reading"));
}

TEST_F(Results, AProposedEffectIsThereForAnUnknownOneAlone) {
  const auto write = [&](const diagnosis::Findings& findings) {
    write_together(folder.path(), result_files(findings, model_of(findings),
                                               {"0.1.0", {"model.toml", "ab12"}, {{"rec01.lcm", "cd34"}}}));
    std::ostringstream out;
    print_verdict(out, findings);
    return std::pair{nlohmann::json::parse(text_of(folder / "verdict.json")), out.str() + result_names(findings)};
  };
  const auto unknown = made_up(Verdict::unknown_effect);
  const auto [verdict, said] = write(unknown);
  const std::string name = "curvature_bevel_saturation_by_time";
  EXPECT_EQ(verdict["proposed_effect"]["name"], name);
  EXPECT_EQ(verdict["proposed_effect"]["file"], "proposed_effect.cpp");
  EXPECT_EQ(verdict["proposals"][0]["form"], "saturation");
  EXPECT_THAT(said, HasSubstr("as an effect, " + name + ", in proposed_effect.cpp"));
  EXPECT_THAT(said, ::testing::EndsWith("model.toml, proposed_effect.cpp"));
  EXPECT_THAT(text_of(folder / "proposed_effect.cpp"), HasSubstr("const Effect& " + name + "() {"));
  EXPECT_THAT(text_of(folder / "report.html"), HasSubstr("proposed_effect.cpp beside this page"));

  auto without = unknown;
  without.proposals.clear();
  for (const auto& findings : {made_up(Verdict::effects_found), made_up(Verdict::nothing_missing), without}) {
    write(unknown);
    const auto [other_verdict, other_said] = write(findings);
    EXPECT_THAT(names_in(folder.path()), UnorderedElementsAre("report.html", "model.toml", "verdict.json"));
    EXPECT_TRUE(other_verdict["proposed_effect"].is_null());
    EXPECT_THAT(other_said + text_of(folder / "report.html"), ::testing::Not(HasSubstr("proposed_effect")));
  }
}

TEST_F(Results, AFullDiskLeavesTheOldOnes) {
  write_together(folder.path(), {{"a", "old"}});
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{1000, 1000};  // a write beyond fails as on a full disk
    ::setrlimit(RLIMIT_FSIZE, &small);
    try {
      write_together(folder.path(), {{"a", std::string(5000, 'n')}});
    } catch (const std::runtime_error& e) {
      ::_exit(std::string(e.what()).find("cannot be written") == std::string::npos ? 2 : 0);
    }
    ::_exit(1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(text_of(folder / "a"), "old");
  EXPECT_THAT(names_in(folder.path()), UnorderedElementsAre("a"));
}

TEST_F(Results, AFolderThatCannotHoldThemIsSaidBeforehandAndNothingMade) {
  std::ofstream(folder / "file") << "x";
  for (const auto& place : {folder / "file", folder / "file" / "below"}) {
    try {
      check_writable(place);
      ADD_FAILURE() << place;
    } catch (const std::runtime_error& e) {
      EXPECT_THAT(e.what(), HasSubstr("cannot hold the results"));
    }
  }
  EXPECT_NO_THROW(check_writable(folder / "not" / "yet"));
  EXPECT_NO_THROW(check_writable("not-yet"));
  EXPECT_FALSE(fs::exists(folder / "not"));
}

}  // namespace
}  // namespace bevel::analysis
