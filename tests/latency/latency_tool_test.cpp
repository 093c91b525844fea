// SPDX-License-Identifier: MIT
// bevel-calibrate --latency from a log on: what it prints goes into a system file as it stands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include <bevel/analysis/calibrate/calibrate_tool.hpp>
#include <bevel/io/config.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/recording_clock.hpp>
#include "tests/latency/stop_and_go.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

using ::testing::HasSubstr;

constexpr const char* kModel =
    "[needle]\ncurvature_per_mm = 0.0047\nwheelbase_mm = 20.0\nlambda1_per_rad = 0.49\nlambda2 = 0.22\n";

class LatencyTool : public testing::Test {
 protected:
  // Cameras as they follow each other in `runs`; the axes of the first.
  CalibrateOptions log_of(const std::vector<test::StopAndGo>& runs, const std::string& config = "") {
    CalibrateOptions o;
    o.latency = (folder_ / "stop-and-go.lcm").string();
    o.model = folder_.write("model.toml", kModel);
    io::LogWriter log(o.latency);
    if (!config.empty()) log.write_text(test::kStart_utime, io::channel::kConfig, config);
    for (std::size_t c = 0; c < runs.size(); ++c) {
      const test::Seen seen = test::simulate(runs[c]);
      for (auto m : seen.tips) {
        m.camera = static_cast<std::int32_t>(c);
        log.write_message(m.utime, io::channel::kTipMeasurement, io::to_message(m));
      }
      for (auto a : seen.axes) {
        a.axis_status = {2, 2};
        if (c == 0) log.write_message(a.utime, io::channel::kActuatorState, io::to_message(a));
      }
    }
    log.close();
    return o;
  }
  // What the tables that were printed say of a camera.
  double printed_s(int camera) const {
    std::string text;
    std::istringstream lines(out_.str());
    for (std::string line; std::getline(lines, line);)
      if (line.find("stamps are") == std::string::npos && line.find("beside the") == std::string::npos)
        text += line + '\n';
    double found_s = std::nan("");
    io::ConfigFile file = io::ConfigFile::parse(text, "printed");
    for (io::Section s : file.sections("camera", io::required)) {
      int number = -1;
      double value_s = 0;
      s.read("camera", number, io::required);
      s.read("latency_s", value_s, io::required);
      if (number == camera) found_s = value_s;
    }
    file.finish();
    return found_s;
  }
  test::TemporaryFolder folder_;
  std::ostringstream out_, err_;
};

TEST_F(LatencyTool, TellsEachCamerasOwn) {
  EXPECT_EQ(run(log_of({{.latency_s = 0.1, .seed = 1}, {.latency_s = 0.03, .seed = 2}}), out_, err_), 0) << err_.str();
  EXPECT_NEAR(printed_s(0), 0.1, 0.01) << out_.str();
  EXPECT_NEAR(printed_s(1), 0.03, 0.01);
  EXPECT_EQ(err_.str(), "");
}

// A log recorded with latency_s in force shows what is left of the delay; what is printed takes the place of the key.
TEST_F(LatencyTool, AddsToWhatWasTakenOffAlready) {
  EXPECT_EQ(run(log_of({{.latency_s = 0.04}}, "[[camera]]\ncamera = 0\nlatency_s = 0.08\n"), out_, err_), 0);
  EXPECT_NEAR(printed_s(0), 0.12, 0.01) << out_.str();
  EXPECT_THAT(out_.str(), HasSubstr("80 ms that the log's CONFIG takes off"));
}

TEST_F(LatencyTool, LeavesTheModelsOwnLatencyAside) {
  CalibrateOptions o = log_of({{.latency_s = 0.1}});
  o.model =
      folder_.write("late.toml", std::string(kModel) + "[[effect]]\nname = \"camera_latency\"\nlatency_s = 0.1\n");
  EXPECT_EQ(run(o, out_, err_), 0);
  EXPECT_NEAR(printed_s(0), 0.1, 0.01);
  EXPECT_THAT(err_.str(), HasSubstr("left aside"));
}

TEST_F(LatencyTool, SaysWhatToRecordAndFails) {
  EXPECT_EQ(run(log_of({{.rate_mm_s = 0.5, .stops = 3}}), out_, err_), 1);
  EXPECT_THAT(err_.str(), HasSubstr("camera 0: the delay is known to +-"));
  EXPECT_EQ(out_.str(), "");
}

TEST_F(LatencyTool, RefusesLogsWithoutAClock) {
  const CalibrateOptions o = log_of({{}}, io::kNoClockConfig);
  EXPECT_THROW(run(o, out_, err_), std::runtime_error);
}

}  // namespace
}  // namespace bevel::analysis
