// SPDX-License-Identifier: MIT
// Logs in which camera and drives have different clocks, and names of logs that are not those of a file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/io/csv_export.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/recording.hpp>
#include "tests/support/temporary_folder.hpp"

namespace bevel::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::int64_t kStart = 1'700'000'000'000'000;

// 10 s of motion at 5 mm/s; measurements of each camera begin so long after the first axis sample.
Recording recording_with(std::vector<double> starts_s) {
  Recording recording;
  for (int i = 0; i < 1000; ++i) {
    model::ActuatorState a;
    a.utime = kStart + 10'000 * i;
    a.seq = i;
    a.insertion_mm = 0.05 * i;
    recording.arrivals.push_back({Arrival::Channel::actuator, recording.actuators.size()});
    recording.actuators.push_back(a);
  }
  for (std::size_t camera = 0; camera < starts_s.size(); ++camera)
    for (int i = 0; i < 300; ++i) {
      model::TipMeasurement m;
      m.utime = kStart + static_cast<std::int64_t>(starts_s[camera] * 1e6) + 33'333 * i;
      m.seq = i;
      m.camera = static_cast<int>(camera);
      m.position_mm.z() = 0.16 * i;
      m.information_per_mm2.diagonal().setConstant(44);
      recording.arrivals.push_back({Arrival::Channel::tip, recording.tips.size()});
      recording.tips.push_back(m);
    }
  return recording;
}

class RecordingTimes : public ::testing::Test {
 protected:
  Recording read(const std::vector<double>& starts_s) {
    const std::string path = (folder_ / "rec.lcm").string();
    write_log(recording_with(starts_s), path);
    return read_recording(path);
  }
  test::TemporaryFolder folder_;
};

TEST_F(RecordingTimes, AnHourBetweenCameraAndAxesIsRefused) {
  for (const double start_s : {3600.0, 3599.0, -3600.0, 7200.0, 20.0, -30.0}) {
    const Recording recording = read({start_s});
    EXPECT_THAT(recording.refusal(), AllOf(HasSubstr("no measurement within the time of the axes"),
                                           HasSubstr("300 of 300 TIP_MEASUREMENT of camera 0 are outside the time of "
                                                     "ACTUATOR_STATE"),
                                           HasSubstr("allowed -1 to 10.99 s; if the clocks differ")))
        << start_s;
    EXPECT_THROW(require_usable("rec.lcm", recording), std::runtime_error);
  }
}

TEST_F(RecordingTimes, AShiftWithinTheInsertionIsReportedAsDamage) {
  const Recording recording = read({4.0});
  EXPECT_EQ(recording.refusal(), "");
  EXPECT_FALSE(recording.intact());
  EXPECT_THAT(recording.remarks("rec.lcm"), HasSubstr("rec.lcm: damaged: 90 of 300 TIP_MEASUREMENT of camera 0"));
}

TEST_F(RecordingTimes, OneOfTwoCamerasIsNamed) {
  const Recording recording = read({0.0, -3600.0});
  EXPECT_EQ(recording.refusal(), "");
  EXPECT_THAT(recording.remarks("rec.lcm"),
              AllOf(HasSubstr("of camera 1 are outside"), ::testing::Not(HasSubstr("of camera 0 are outside"))));
}

TEST_F(RecordingTimes, ACameraThatStartsEarlierOrEndsLaterIsNoDamage) {
  for (const double start_s : {0.0, -1.5, 1.5}) EXPECT_TRUE(read({start_s}).intact()) << start_s;
}

TEST(FindLogs, ALogWhoseNameHasOnlyDotsIsRefused) {
  const test::TemporaryFolder folder;
  for (const char* name : {"...lcm", "..lcm", "....lcm"}) {
    const std::string path = folder.write(name, "");
    const auto only_dots = ThrowsMessage<std::runtime_error>(HasSubstr("with a character that is no dot. Rename"));
    EXPECT_THAT([&] { find_logs({path}); }, only_dots) << name;
    EXPECT_THAT([&] { find_logs({folder.path().string()}); },
                ThrowsMessage<std::runtime_error>(HasSubstr("holds no log")))
        << name << " is hidden in a folder";
    std::filesystem::remove(path);
  }
  EXPECT_NO_THROW(find_logs({folder.write("..a.lcm", "")}));
}

}  // namespace
}  // namespace bevel::io
