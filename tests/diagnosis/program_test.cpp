// SPDX-License-Identifier: MIT
// bevel-diagnose as a program: its files, its messages, its exit status, and an end from outside.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include <bevel/io/model_file.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include "tests/diagnosis/recorded_logs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;
using model::testing::active;
using test::text_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

struct Said {
  int status = -1;
  std::string out, err;
};

struct Program : ::testing::Test {
  test::TemporaryFolder folder;
  std::vector<std::string> logs;
  std::string model_path = (folder / "model.toml").string();

  void SetUp() override { io::save_model_file({model::testing::agar(), {}}, model_path); }

  void write_logs(const std::vector<model::ActiveEffect>& effects) {
    for (int i = 0; i < 4; ++i) {
      const fs::path path = folder / ("rec0" + std::to_string(i + 1) + ".lcm");
      diagnosis::testing::write_log(path, {.script = i, .effects = effects});
      logs.push_back(path.string());
    }
  }

  pid_t start(std::vector<std::string> words) const {
    words.insert(words.begin(), std::string(BEVEL_BINARY_DIR) + "/bin/bevel-diagnose");
    std::vector<char*> pointers;
    for (auto& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const pid_t child = ::fork();
    if (child != 0) return child;
    const auto redirect = [&](int to, const char* name) {
      ::dup2(::open((folder / name).c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), to);  // NOLINT(*-vararg)
    };
    redirect(STDOUT_FILENO, "stdout");
    redirect(STDERR_FILENO, "stderr");
    ::execv(pointers[0], pointers.data());
    ::_exit(127);
  }
  Said wait_for(pid_t child) const {
    int status = 0;
    ::waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text_of(folder / "stdout"),
            text_of(folder / "stderr")};
  }
  Said run(const std::vector<std::string>& words) const { return wait_for(start(words)); }
  std::vector<std::string> usual(const std::string& out, std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--model", model_path, "--out", (folder / out).string()});
    more.insert(more.end(), logs.begin(), logs.end());
    return more;
  }
};

TEST_F(Program, FindsAConcealedEffectAndWritesAllThreeFiles) {
  write_logs({active("insertion_scale", {0.92})});
  fs::create_directories(folder / "out");
  std::ofstream(folder / "out/proposed_effect.cpp") << "of an earlier run";
  const Said said = run(usual("out"));
  ASSERT_EQ(said.status, 0) << said.err;
  EXPECT_FALSE(fs::exists(folder / "out/proposed_effect.cpp"));
  EXPECT_THAT(said.out,
              AllOf(HasSubstr("insertion_scale"), HasSubstr("ratio"), HasSubstr("predicted from the others")));
  EXPECT_THAT(said.err, HasSubstr(" s  reading 4 logs"));
  const auto verdict = nlohmann::json::parse(text_of(folder / "out/verdict.json"));
  EXPECT_EQ(verdict["verdict"], "effects-found");
  const auto& ratio = verdict["effects"][0]["parameters"]["ratio"];
  EXPECT_NEAR(ratio["value"].get<double>(), 0.92, 5 * ratio["std_error"].get<double>());
  const auto model = io::load_model_file((folder / "out/model.toml").string());
  ASSERT_EQ(model.effects.size(), 1U);
  EXPECT_DOUBLE_EQ(model.effects[0].parameters.at("ratio"), ratio["value"].get<double>());
  EXPECT_GT(fs::file_size(folder / "out/report.html"), 50'000U);

  // Eight hundredths of the way, 60 mm and more: the tip is moved by millimetres, and nobody who does not know of it
  // comes as near to a target.
  EXPECT_GT(verdict["effects"][0]["moved_at_depth_mm"].get<double>(), 3);
  EXPECT_LT(verdict["effects"][0]["moved_at_depth_mm"].get<double>(), 8);
  const auto& steered = verdict["steered"];
  EXPECT_EQ(steered["targets"], 8);
  EXPECT_EQ(steered["found"]["arrived"], 8);
  EXPECT_LT(steered["found"]["worst_mm"].get<double>(), 0.5);
  EXPECT_GE(steered["found"]["worst_mm"].get<double>(), steered["found"]["median_mm"].get<double>());
  EXPECT_TRUE(steered["as_it_stands"]["arrived"] == 0 ||
              steered["as_it_stands"]["median_mm"].get<double>() > steered["found"]["median_mm"].get<double>())
      << steered;
  EXPECT_EQ(steered["as_it_stands"]["arrived"] == 8, steered["as_it_stands"]["stopped_by"].get<std::string>().empty());
  EXPECT_THAT(said.out, HasSubstr("steered in simulation to targets"));

  // The same input: the same verdict, whatever the number of threads.
  ASSERT_EQ(run(usual("again", {"--threads", "1", "--quiet"})).status, 0);
  EXPECT_EQ(text_of(folder / "again/verdict.json"), text_of(folder / "out/verdict.json"));
}

// Two groups, one of them a folder; a log's name is told from the same name in the other group.
TEST_F(Program, SaysWhatChangedBetweenTwoGroups) {
  std::vector<std::string> words{
      "--quiet",  "--model", model_path, "--out", (folder / "out").string(), "--baseline", (folder / "before").string(),
      "--changed"};
  for (const char* group : {"before", "after"}) {
    fs::create_directories(folder / group);
    const bool changed = std::string(group) == "after";
    for (int i = 0; i < 2; ++i) {
      const fs::path path = folder / group / ("rec0" + std::to_string(i + 1) + ".lcm");
      diagnosis::testing::write_log(path, {.script = i + (changed ? 2 : 0)});
      if (changed) words.push_back(path.string());
    }
  }
  const Said said = run(words);
  ASSERT_EQ(said.status, 0) << said.err;
  EXPECT_THAT(said.out, AllOf(HasSubstr("Unchanged"), HasSubstr("by what both share")));
  const auto verdict = nlohmann::json::parse(text_of(folder / "out/verdict.json"));
  EXPECT_EQ(verdict["verdict"], "unchanged");
  EXPECT_TRUE(verdict["effects"].empty());
  EXPECT_TRUE(verdict["changes"].empty());
  EXPECT_TRUE(verdict["steered"].is_null());
  EXPECT_FALSE(verdict["detectable"].empty());
  EXPECT_FALSE(verdict.contains("needle"));
  EXPECT_TRUE(verdict["fit"]["recordings"].contains("changed/rec01.lcm"));
  EXPECT_FALSE(verdict["fit"]["recordings"].contains("baseline/rec01.lcm"));
  const auto model = io::load_model_file((folder / "out/model.toml").string());
  EXPECT_DOUBLE_EQ(model.needle.curvature_per_mm, model::testing::agar().curvature_per_mm);
  EXPECT_TRUE(model.effects.empty());
}

TEST_F(Program, GroupsAreGivenWholeOrNotAtAll) {
  const std::string model = model_path, out = (folder / "out").string();
  const Said one = run({"--model", model, "--out", out, "--baseline", folder.path().string()});
  EXPECT_EQ(one.status, 2);
  EXPECT_THAT(one.err, HasSubstr("--changed"));
  const Said both = run({"a.lcm", "--model", model, "--out", out, "--baseline", "b", "--changed", "c"});
  EXPECT_EQ(both.status, 2);
  const Said none = run({"--model", model, "--out", out});
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("LOG"));
  fs::create_directories(folder / "empty");
  const std::string empty = (folder / "empty").string();
  const Said nothing = run({"--model", model, "--out", out, "--baseline", empty, "--changed", empty});
  EXPECT_EQ(nothing.status, 1);
  EXPECT_THAT(nothing.err, HasSubstr("empty"));
}

TEST_F(Program, ProposesAnEffectForWhatIsOnNoList) {
  model::DiscrepancyCurve curve{model::DiscrepancyComponent::advance, model::Covariate::depth_mm, {}, {}, {}};
  for (int i = 0; i <= 30; ++i) {
    curve.at.push_back(2.5 * i);
    curve.values.push_back(0.12 * (1 - std::exp(-curve.at.back() / 14)));
    curve.std_errors.push_back(0);
  }
  write_logs({model::active_discrepancy(curve)});
  const Said said = run(usual("out"));
  ASSERT_EQ(said.status, 0) << said.err;
  EXPECT_THAT(said.out, HasSubstr("as an effect, advance_saturation_by_depth, in proposed_effect.cpp"));
  const auto verdict = nlohmann::json::parse(text_of(folder / "out/verdict.json"));
  EXPECT_EQ(verdict["verdict"], "unknown-effect");
  EXPECT_EQ(verdict["proposed_effect"]["name"], "advance_saturation_by_depth");
  EXPECT_THAT(text_of(folder / "out/proposed_effect.cpp"), HasSubstr("EFFECT(advance_saturation_by_depth)"));
}

TEST_F(Program, ALogCutOffIsDiagnosedSaidAndStatusThree) {
  write_logs({});
  fs::resize_file(logs[3], fs::file_size(logs[3]) - 40);
  const Said said = run(usual("out", {"--quiet"}));
  EXPECT_EQ(said.status, 3);
  EXPECT_THAT(said.err, HasSubstr("rec04.lcm: damaged (log: the last event is cut off"));
  EXPECT_THAT(said.out, HasSubstr("rec04.lcm: damaged"));
  EXPECT_THAT(text_of(folder / "out/report.html"), HasSubstr("rec04.lcm: damaged"));
}

TEST_F(Program, EndedFromOutsideItLeavesNothing) {
  write_logs({});
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove(folder / "stderr");
    const pid_t child = start(usual("out"));
    while (text_of(folder / "stderr").find("reading") == std::string::npos)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // into the work
    ::kill(child, signal);
    const Said said = wait_for(child);
    EXPECT_EQ(said.status, 1);
    EXPECT_THAT(said.err, HasSubstr("bevel-diagnose: stopped; nothing was written"));
    EXPECT_FALSE(fs::exists(folder / "out"));
  }
}

TEST_F(Program, BadInputIsOneMessageAndStatusOne) {
  write_logs({});
  const auto expect_refused = [&](const std::vector<std::string>& words, const std::string& because) {
    const Said said = run(words);
    EXPECT_EQ(said.status, 1) << because;
    EXPECT_THAT(said.err, HasSubstr(because));
    EXPECT_THAT(said.err, HasSubstr("bevel-diagnose: "));
    EXPECT_THAT(said.out, IsEmpty());
    EXPECT_FALSE(fs::exists(folder / "out"));
  };
  expect_refused({"-m", model_path, "-o", (folder / "out").string(), logs[0]}, "at least two are needed");
  expect_refused({"-m", (folder / "no.toml").string(), "-o", (folder / "out").string(), logs[0]}, "no.toml");
  expect_refused({"-m", model_path, "-o", logs[0] + "/out", logs[0], logs[1]}, "cannot hold the results");

  std::ofstream(folder / "wild.toml") << "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\n"
                                      << "lambda1_per_rad = 0.01\nlambda2 = 0.9\n";
  expect_refused({"-m", (folder / "wild.toml").string(), "-o", (folder / "out").string(), logs[0], logs[1]},
                 "wild.toml");
}

// What the model in use has already is held, and kept in what is written.
TEST_F(Program, DiagnosesOnTopOfWhatIsKnown) {
  write_logs({active("drilling", {2.0}), active("insertion_scale", {0.92})});
  io::save_model_file({model::testing::agar(), {{"drilling", {{"coefficient_mm_per_rad", 2.0}}, {}}}}, model_path);
  const Said said = run(usual("out"));
  ASSERT_EQ(said.status, 0) << said.err;
  const auto verdict = nlohmann::json::parse(text_of(folder / "out/verdict.json"));
  ASSERT_EQ(verdict["effects"].size(), 1U) << said.out;
  EXPECT_EQ(verdict["effects"][0]["name"], "insertion_scale");
  const io::ModelFile model = io::load_model_file((folder / "out/model.toml").string());
  ASSERT_EQ(model.effects.size(), 2U);
  EXPECT_EQ(model.effects[0].name, "drilling");
  EXPECT_EQ(model.effects[1].name, "insertion_scale");
  ASSERT_TRUE(model.variation.has_value());
}

TEST_F(Program, UsageErrorsAreStatusTwo) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{},
                                                {"--model", model_path, "--out", "x"},
                                                {"--out", "x", "a.lcm"},
                                                usual("out", {"--threads", "0", "a.lcm"}),
                                                usual("out", {"--targets", "-1", "a.lcm"})}) {
    const Said said = run(words);
    EXPECT_EQ(said.status, 2) << said.err;
    EXPECT_THAT(said.err, Not(IsEmpty()));
  }
  EXPECT_EQ(run({"--help"}).status, 0);
  EXPECT_THAT(run({"--version"}).out, HasSubstr("bevel-diagnose"));
}

}  // namespace
}  // namespace bevel::analysis
