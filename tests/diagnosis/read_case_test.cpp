// SPDX-License-Identifier: MIT
// Input that cannot be diagnosed: each has one clear message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include <bevel/analysis/diagnose/read_case.hpp>
#include "tests/diagnosis/recorded_logs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;
using diagnosis::testing::LogContents;
using test::text_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct ReadLogs : ::testing::Test {
  test::TemporaryFolder folder;
  std::vector<std::string> logs;

  void SetUp() override {
    for (int i = 0; i < 3; ++i) logs.push_back(write("rec0" + std::to_string(i + 1) + ".lcm", {.script = i}));
  }

  std::string write(const std::string& name, const LogContents& contents) const {
    write_log(folder / name, contents);
    return (folder / name).string();
  }
  static std::string refusal(const std::vector<std::string>& of) {
    try {
      read_case(of);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "taken";
  }
};

TEST_F(ReadLogs, SoundLogsAreTakenByTheirFileNames) {
  const ReadCase read = read_case(logs);
  ASSERT_EQ(read.recorded.recordings.size(), 3U);
  EXPECT_EQ(read.recorded.recordings[1].name, "rec02.lcm");
  EXPECT_TRUE(read.remarks.empty());
}

TEST_F(ReadLogs, OneRecordingOnly) { EXPECT_THAT(refusal({logs[0]}), HasSubstr("at least two are needed")); }

TEST_F(ReadLogs, AFileThatIsNotThere) {
  EXPECT_THAT(refusal({logs[0], (folder / "none.lcm").string()}), HasSubstr("none.lcm"));
}

TEST_F(ReadLogs, AFolderInPlaceOfALog) {
  const ReadCase read = read_case({folder.path().string()});
  ASSERT_EQ(read.recorded.recordings.size(), 3U);
  EXPECT_EQ(read.recorded.recordings[2].name, "rec03.lcm");
  EXPECT_THAT(refusal({logs[0], folder.path().string()}), HasSubstr("rec01.lcm: given twice"));
  fs::create_directories(folder / "empty");
  EXPECT_THAT(refusal({logs[0], (folder / "empty").string()}),
              HasSubstr("empty: holds no log; expected are files named *.lcm"));
}

TEST_F(ReadLogs, TheSameLogTwice) {
  EXPECT_THAT(refusal({logs[0], logs[1], logs[0]}), HasSubstr("given twice"));
  EXPECT_THAT(refusal({logs[0], (folder / "." / "rec01.lcm").string()}), HasSubstr("given twice"));
  const auto copy = folder.write("copy.lcm", text_of(logs[1]));
  EXPECT_THAT(refusal({logs[0], logs[1], copy}),
              AllOf(HasSubstr("copy.lcm: the same recording as"), HasSubstr("rec02")));
}

// Logs of the demo are all named insertion.lcm.
TEST_F(ReadLogs, LogsOfOneNameAreToldApartByTheirFolders) {
  for (const char* name : {"a/day", "b/day", "c"}) fs::create_directories(folder / name);
  const ReadCase read =
      read_case({write("a/day/insertion.lcm", {.script = 5}), logs[0], write("b/day/insertion.lcm", {.script = 1}),
                 write("c/insertion.lcm", {.script = 2})});
  std::vector<std::string> names;
  for (const auto& recording : read.recorded.recordings) names.push_back(recording.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("a/day/insertion.lcm", "rec01.lcm", "b/day/insertion.lcm",
                                                     "c/insertion.lcm"));
}

TEST_F(ReadLogs, NoTipMeasurement) {
  const auto blind = write("blind.lcm", {.script = 3, .tips = false});
  EXPECT_THAT(refusal({logs[0], blind}), AllOf(HasSubstr("blind.lcm"), HasSubstr("no usable TIP_MEASUREMENT")));
}

TEST_F(ReadLogs, NoActuatorState) {
  const auto still = write("still.lcm", {.script = 3, .states = false});
  EXPECT_THAT(refusal({logs[0], still}), AllOf(HasSubstr("still.lcm"), HasSubstr("ACTUATOR_STATE")));
}

TEST_F(ReadLogs, ClocksApart) {
  const auto apart = write("apart.lcm", {.script = 3, .camera_ahead_s = 3600});
  EXPECT_THAT(refusal({logs[0], apart}), AllOf(HasSubstr("apart.lcm"), HasSubstr("clocks")));
}

TEST_F(ReadLogs, TwoRigsMixed) {
  const auto other = write("other.lcm", {.script = 3, .information_per_mm2 = {0, 1, 1}});
  EXPECT_THAT(refusal({logs[0], other}), HasSubstr("different rigs"));
}

TEST_F(ReadLogs, MotionUnknownForAWhile) {
  const auto gap = write("gap.lcm", {.script = 3, .states_missing_from_s = 4});
  EXPECT_THAT(refusal({logs[0], gap}), AllOf(HasSubstr("gap.lcm: no ACTUATOR_STATE for 2"), HasSubstr("not known")));
}

TEST_F(ReadLogs, ABaseThatIsMeasuredEvery800MillisecondsHasNoGap) {
  const auto slow = write("slow.lcm", {.script = 3, .state_period_s = 0.8});
  EXPECT_EQ(read_case({logs[0], slow}).recorded.recordings.size(), 2U);
}

TEST_F(ReadLogs, EmptyAndForeignFiles) {
  EXPECT_THAT(refusal({logs[0], folder.write("empty.lcm", "")}), HasSubstr("empty.lcm"));
  EXPECT_THAT(refusal({logs[0], folder.write("text.lcm", std::string(5000, 'x'))}),
              AllOf(HasSubstr("text.lcm: no LCM event in its 5000 bytes"), Not(HasSubstr("empty"))));
}

TEST_F(ReadLogs, ALittleDamageIsARemarkMuchIsARefusal) {
  std::string bytes = text_of(logs[2]);
  std::fill_n(bytes.begin() + 20'000, 150, 'x');
  const ReadCase read = read_case({logs[0], logs[1], folder.write("scratched.lcm", bytes)});
  ASSERT_EQ(read.remarks.size(), 1U);
  EXPECT_THAT(read.remarks[0], AllOf(HasSubstr("scratched.lcm: damaged"), HasSubstr("skipped")));

  const auto torn = folder.write("torn.lcm", text_of(logs[2]).substr(0, bytes.size() - 40));
  EXPECT_THAT(read_case({logs[0], torn}).remarks.at(0), HasSubstr("torn.lcm: damaged"));

  std::fill(bytes.begin() + 20'000, bytes.begin() + 60'000, 'x');
  EXPECT_THAT(refusal({logs[0], folder.write("gutted.lcm", bytes)}),
              AllOf(HasSubstr("gutted.lcm: damaged beyond use"), HasSubstr("at most 20 %")));
}

}  // namespace
}  // namespace bevel::analysis
