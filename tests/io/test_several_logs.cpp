// SPDX-License-Identifier: MIT
// Programs that take several logs keep the results of all of them, whatever the logs are named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include <bevel/io/log_reader.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include "tests/support/run_program.hpp"

namespace bevel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct SeveralLogs : ::testing::Test {
  // A straight insertion of 6 s at 50 Hz, 10 mm/s.
  void write(const std::string& name, double x_mm) const {
    fs::create_directories((folder / name).parent_path());
    io::LogWriter log((folder / name).string());
    for (std::int64_t i = 0; i < 300; ++i) {
      const double depth_mm = 0.2 * static_cast<double>(i);
      const std::int64_t utime = 1'700'000'000'000'000 + 20'000 * i;
      const model::ActuatorState a{
          .utime = utime, .seq = i, .axis_status = {2, 2}, .insertion_mm = depth_mm, .insertion_rate_mm_s = 10};
      log.write_message(utime, io::channel::kActuatorState, io::to_message(a));
      model::TipMeasurement tip{.utime = utime, .seq = i};
      tip.position_mm = {x_mm, 0, depth_mm};
      tip.information_per_mm2.diagonal().setConstant(44);
      log.write_message(utime, io::channel::kTipMeasurement, io::to_message(tip));
    }
    log.close();
  }
  std::vector<std::string> results(const std::string& name) const {
    std::vector<std::string> out;
    for (const auto& entry : fs::directory_iterator(folder / name)) out.push_back(entry.path().filename().string());
    return out;
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  void run(const std::string& program, const std::string& arguments) const {
    const test::Said said = test::run_program(folder, program, arguments);
    EXPECT_EQ(said.status, 0) << program << ": " << said.err;
  }
  test::TemporaryFolder folder;
  std::string model = folder.write(
      "model.toml",
      "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n");
};

TEST_F(SeveralLogs, NamedByLcmLoggerEachHaveResults) {
  for (const char* end : {"00", "01", "02"}) write(std::string("day/lcmlog-2026-03-02.") + end, 0);
  run("bevel-export", "-o " + path("csv") + " " + path("day"));
  EXPECT_THAT(results("csv"),
              ::testing::UnorderedElementsAre("lcmlog-2026-03-02.00", "lcmlog-2026-03-02.01", "lcmlog-2026-03-02.02"));
  run("bevel-export", "--format mcap -o " + path("mcap") + " " + path("day"));
  EXPECT_EQ(results("mcap").size(), 3U);
  run("bevel-import", "-o " + path("logs") + " " + path("csv/*"));
  EXPECT_EQ(results("logs").size(), 3U);
  run("bevel-replay", "-m " + model + " --out " + path("replay") + " " + path("day"));
  EXPECT_EQ(results("replay").size(), 9U) << "two CSV files and a page of each";
}

TEST_F(SeveralLogs, OfOneNameInTwoFoldersEachHaveResults) {
  write("monday/a/rec.lcm", 0);
  write("tuesday/a/rec.lcm", 0.5);
  const std::string both = " " + path("monday/a") + " " + path("tuesday/a");
  run("bevel-export", "-o " + path("csv") + both);
  EXPECT_THAT(results("csv"), ::testing::UnorderedElementsAre("monday_a_rec", "tuesday_a_rec"));
  EXPECT_NE(test::text_of(path("csv/monday_a_rec/tip_measurement.csv")),
            test::text_of(path("csv/tuesday_a_rec/tip_measurement.csv")));
  run("bevel-replay", "-m " + model + " --out " + path("replay") + both);
  EXPECT_EQ(results("replay").size(), 6U);
  // Status 1: the fit of needles that do not bend does not converge, and the results are written all the same.
  test::run_program(folder, "bevel-identify", "-m " + model + " --out " + path("found") + both);
  const std::string figures = test::text_of(path("found/figures.json"));
  EXPECT_THAT(figures, HasSubstr("\"monday_a_rec\""));
  EXPECT_THAT(figures, HasSubstr("\"tuesday_a_rec\""));
}

// Without the order of time, replay would drop the measurements that have left its history.
TEST_F(SeveralLogs, SortedByChannelReplayAsTheOriginal) {
  write("rec.lcm", 0.3);
  const std::string text = test::text_of(path("rec.lcm"));
  io::LogReader reader({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  std::vector<io::LogEvent> events;
  while (const auto event = reader.next()) events.push_back(*event);
  std::ranges::stable_sort(events, {}, &io::LogEvent::channel);
  fs::create_directories(folder / "sorted");
  io::LogWriter log(path("sorted/rec.lcm"));
  for (const io::LogEvent& event : events) log.write(event.timestamp_us, event.channel, event.data);
  log.close();
  run("bevel-replay", "-m " + model + " --out " + path("one") + " " + path("rec.lcm"));
  const test::Said said =
      test::run_program(folder, "bevel-replay", "-m " + model + " --out " + path("two") + " " + path("sorted/rec.lcm"));
  EXPECT_EQ(said.status, 0) << said.err;
  EXPECT_THAT(said.err, HasSubstr("of 600 events stand behind later ones"));
  for (const std::string& name : results("one"))
    if (name.ends_with(".csv")) {
      EXPECT_EQ(test::text_of(folder / "one" / name), test::text_of(folder / "two" / name));
    }
}

}  // namespace
}  // namespace bevel
