// SPDX-License-Identifier: MIT
// Video4Linux's buffers: their numbers, clocks and pixels, and a source on a recorded stream of them; a real device
// where BEVEL_V4L2_DEVICE names one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cstdlib>
#include <deque>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include <bevel/drivers/camera/frame_sources.hpp>
#include <bevel/drivers/camera/pipeline.hpp>
#include <bevel/drivers/camera/planar_view.hpp>

namespace bevel::camera {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr uint32_t kMonotonic = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_DONE;
// A machine that has been up for an hour.
constexpr ClockPair kNow{3'600'000'000, 1'700'000'000'000'000};

CapturedBuffer buffer_of(uint32_t sequence, int64_t timestamp_us, uint32_t flags = kMonotonic) {
  return {0, flags, sequence, timestamp_us, {}};
}

TEST(BufferCount, TranslatesTheDriversClockToTheEpoch) {
  BufferCount count;
  const auto stamp = count.count(buffer_of(0, kNow.monotonic_us - 42'000), kNow);
  EXPECT_TRUE(stamp.driver);
  EXPECT_EQ(stamp.utime, kNow.realtime_us - 42'000);
  // The wall clock is set back by a minute: capture times go with it, the age stays.
  const auto later =
      count.count(buffer_of(1, kNow.monotonic_us), {kNow.monotonic_us + 10'000, kNow.realtime_us - 60'000'000});
  EXPECT_EQ(later.utime, kNow.realtime_us - 60'000'000 - 10'000);
}

TEST(BufferCount, StampsOnArrivalWhatTheDriverDoesNotTell) {
  struct Case {
    const char* why;
    uint32_t flags;
    int64_t timestamp_us;
  };
  const Case cases[] = {
      {"no clock named", V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, kNow.monotonic_us - 42'000},
      {"copied from elsewhere", V4L2_BUF_FLAG_TIMESTAMP_COPY, kNow.monotonic_us - 42'000},
      {"zero", kMonotonic, 0},
      {"after now", kMonotonic, kNow.monotonic_us + 1},
      {"of the wall clock", kMonotonic, kNow.realtime_us},
      {"two seconds old", kMonotonic, kNow.monotonic_us - 2'000'000},
  };
  for (const Case& c : cases) {
    const auto stamp = BufferCount().count(buffer_of(0, c.timestamp_us, c.flags), kNow);
    EXPECT_FALSE(stamp.driver) << c.why;
    EXPECT_EQ(stamp.utime, kNow.realtime_us) << c.why;
  }
}

TEST(BufferCount, CountsAsTheDriverDoes) {
  BufferCount count;
  std::vector<int64_t> seen;
  for (const uint32_t sequence : {0xFFFFFFFEU, 0xFFFFFFFFU, 0U, 1U, 5U, 6U})
    seen.push_back(count.count(buffer_of(sequence, 1), kNow).seq);
  EXPECT_EQ(seen, (std::vector<int64_t>{0, 1, 2, 3, 7, 8})) << "across the wrap, with three lost";
  EXPECT_EQ(count.count(buffer_of(0, 1), kNow).seq, 9) << "a counter that began anew loses nothing";
  BufferCount still;
  for (int64_t i = 0; i < 4; ++i)
    EXPECT_EQ(still.count(buffer_of(0, 1), kNow).seq, i) << "a driver that does not count";
}

TEST(Pixels, BrightnessOfEachFormatWithPaddedLines) {
  constexpr int kWide = 6, kHigh = 4;
  constexpr size_t w = kWide, h = kHigh;
  cv::Mat expected(kHigh, kWide, CV_8UC1);
  for (int r = 0; r < kHigh; ++r)
    for (int c = 0; c < kWide; ++c) expected.at<uchar>(r, c) = static_cast<uchar>(10 * r + c + 1);
  struct Case {
    const char* name;
    size_t step, first, behind;  // bytes from pixel to pixel, before the first, after the last line
  };
  for (const Case& f : {Case{"GREY", 1, 0, 0}, Case{"NV12", 1, 0, 20}, Case{"YU12", 1, 0, 20}, Case{"YUYV", 2, 0, 0},
                        Case{"UYVY", 2, 1, 0}}) {
    const size_t line = f.step * w + 5;
    std::vector<uint8_t> bytes(line * h + f.behind, 200);
    for (int r = 0; r < kHigh; ++r)
      for (int c = 0; c < kWide; ++c)
        bytes[static_cast<size_t>(r) * line + f.first + static_cast<size_t>(c) * f.step] = expected.at<uchar>(r, c);
    const PixelLayout layout{fourcc_from(f.name), kWide, kHigh, line};
    const cv::Mat gray = gray_of(layout, bytes);
    ASSERT_EQ(gray.size(), expected.size()) << f.name;
    EXPECT_EQ(cv::norm(gray, expected, cv::NORM_INF), 0.0) << f.name;
    EXPECT_EQ(name_of_fourcc(layout.fourcc), f.name);
    for (const size_t part : {size_t{0}, size_t{1}, line * (h - 1)})
      EXPECT_TRUE(gray_of(layout, std::span(bytes).first(part)).empty()) << f.name << " of " << part << " bytes";
    EXPECT_TRUE(gray_of({layout.fourcc, kWide, kHigh, f.step * w - 1}, bytes).empty())
        << "lines shorter than the picture";
  }
}

TEST(Pixels, JpegOfTheRightSizeOnly) {
  cv::Mat picture(48, 64, CV_8UC1, cv::Scalar(90));
  picture.colRange(20, 40).setTo(170);
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", picture, jpeg);
  const PixelLayout layout{fourcc_from("MJPG"), 64, 48, 0};
  const cv::Mat gray = gray_of(layout, jpeg);
  ASSERT_FALSE(gray.empty());
  EXPECT_LT(cv::norm(gray, picture, cv::NORM_L1) / (48.0 * 64.0), 2.0);
  EXPECT_TRUE(gray_of({layout.fourcc, 32, 48, 0}, jpeg).empty());
  EXPECT_TRUE(gray_of(layout, {}).empty());
  EXPECT_TRUE(gray_of(layout, std::vector<uint8_t>(500, 7)).empty());
  EXPECT_TRUE(gray_of({fourcc_from("RGB3"), 64, 48, 192}, jpeg).empty());
}

// A recorded stream: what each waking finds. Four buffers, as a driver would lend.
class RecordedDevice : public CaptureDevice {
 public:
  struct One {
    uint32_t sequence;
    int64_t timestamp_us;
    uint8_t shade;
    uint32_t flags = kMonotonic;
    size_t bytes = size_t{64} * 48;
  };
  explicit RecordedDevice(std::deque<std::vector<One>> wakings) : wakings_(std::move(wakings)) {}
  ~RecordedDevice() override { EXPECT_TRUE(lent_.empty()) << "buffers were kept"; }
  const PixelLayout& layout() const override { return layout_; }
  bool wait(milliseconds /*timeout*/) override {
    if (wakings_.empty()) return gone_at_the_end;
    now_ = std::move(wakings_.front());
    wakings_.pop_front();
    return true;
  }
  std::variant<CapturedBuffer, NothingYet, DeviceGone> take() override {
    if (now_.empty()) {
      if (wakings_.empty() && gone_at_the_end) return DeviceGone{"'stand-in': No such device (unplugged?)"};
      return NothingYet{};
    }
    const One one = now_.front();
    now_.erase(now_.begin());
    uint32_t index = 0;
    while (lent_.contains(index)) ++index;
    EXPECT_LT(index, 4U) << "a driver has no more";
    lent_.insert(index);
    memory_.at(index).assign(one.bytes, one.shade);
    return CapturedBuffer{index, one.flags, one.sequence, one.timestamp_us, memory_.at(index)};
  }
  void give_back(uint32_t index) override { EXPECT_EQ(lent_.erase(index), 1U); }

  bool gone_at_the_end = false;

 private:
  PixelLayout layout_{V4L2_PIX_FMT_GREY, 64, 48, 64};
  std::deque<std::vector<One>> wakings_;
  std::vector<One> now_;
  std::set<uint32_t> lent_;
  std::array<std::vector<uint8_t>, 4> memory_;
};

std::unique_ptr<DeviceSource> source_on(std::unique_ptr<RecordedDevice> device) {
  return std::make_unique<DeviceSource>(SourceConfig{.kind = SourceKind::device, .path = "stand-in", .camera = 2},
                                        std::move(device), [] { return kNow; });
}

TEST(DeviceSource, GivesTheNewestWholeFrameByItsOwnNumberAndTime) {
  const int64_t t = kNow.monotonic_us;
  const auto source = source_on(std::make_unique<RecordedDevice>(std::deque<std::vector<RecordedDevice::One>>{
      {{10, t - 90'000, 1}},
      {{11, t - 80'000, 2}, {12, t - 70'000, 3}},               // fell behind by one
      {{15, t - 60'000, 4}},                                    // the driver lost two
      {{16, t - 50'000, 5, kMonotonic | V4L2_BUF_FLAG_ERROR}},  // bytes are missing
      {{17, t - 40'000, 6, kMonotonic, 1000}},                  // fewer than a picture has
      {{18, t - 30'000, 7}, {19, t - 20'000, 8, kMonotonic | V4L2_BUF_FLAG_ERROR}},
      {{20, 0, 9}},  // not stamped
  }));
  struct Expected {
    int64_t seq, age_us;
    int shade;
    bool on_arrival;
  };
  for (const Expected& e : {Expected{0, 90'000, 1, false}, Expected{2, 70'000, 3, false}, Expected{5, 60'000, 4, false},
                            Expected{8, 30'000, 7, false}, Expected{10, 0, 9, true}}) {
    const FrameResult got = source->next(milliseconds(1000));
    ASSERT_TRUE(std::holds_alternative<Frame>(got));
    const Frame& frame = std::get<Frame>(got);
    EXPECT_EQ(frame.seq, e.seq);
    EXPECT_EQ(frame.capture_utime, kNow.realtime_us - e.age_us);
    EXPECT_EQ(frame.camera, 2);
    EXPECT_EQ(frame.stamped_on_arrival, e.on_arrival);
    EXPECT_EQ(cv::norm(frame.gray, cv::Mat(48, 64, CV_8UC1, cv::Scalar(e.shade)), cv::NORM_INF), 0.0);
  }
  EXPECT_TRUE(std::holds_alternative<FrameTimeout>(source->next(milliseconds(10))));
}

TEST(DeviceSource, AnUnpluggedDeviceIsAFailure) {
  auto device = std::make_unique<RecordedDevice>(std::deque<std::vector<RecordedDevice::One>>{});
  device->gone_at_the_end = true;
  const auto source = source_on(std::move(device));
  const FrameResult got = source->next(milliseconds(10));
  ASSERT_TRUE(std::holds_alternative<SourceFailure>(got));
  EXPECT_THAT(std::get<SourceFailure>(got).text, HasSubstr("unplugged"));
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->next(milliseconds(10))));
}

TEST(DeviceSource, LostAndUnstampedFramesAreCounted) {
  const int64_t t = kNow.monotonic_us;
  auto source = source_on(std::make_unique<RecordedDevice>(std::deque<std::vector<RecordedDevice::One>>{
      {{1, t - 100'000, 1}}, {{2, t - 66'000, 2}}, {{6, t - 33'000, 3}}, {{7, 0, 4}}}));
  PlanarViewConfig view;
  view.px_per_mm = 5;
  CameraPipeline pipeline(std::move(source), {{2, std::make_shared<PlanarView>(view), TrackerConfig{}, {}}});
  while (std::holds_alternative<TipObservation>(pipeline.next(milliseconds(1000)))) {
  }
  EXPECT_EQ(pipeline.counters().frames, 4);
  EXPECT_EQ(pipeline.counters().lost_frames, 3);
  EXPECT_EQ(pipeline.counters().stamped_on_arrival, 1);
}

TEST(DeviceSource, RefusesByName) {
  SourceConfig config{.kind = SourceKind::device, .path = "/dev/null"};
  const auto refusal = [&config]() -> std::string {
    try {
      make_frame_source(config);
    } catch (const SourceError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(), HasSubstr("'/dev/null': not a Video4Linux device"));
  config.path = "/dev/no-such-device";
  EXPECT_THAT(refusal(), HasSubstr("No such file"));
  config.fourcc = "RGB3";
  EXPECT_THAT(refusal(), HasSubstr("'RGB3', allowed: YUYV"));
}

// On a camera, v4l2loopback that is fed, or the kernel's own vivid: BEVEL_V4L2_DEVICE=/dev/video0, and
// BEVEL_V4L2_FOURCC if it is not YUYV. 640 x 480 at 30 Hz is asked for.
TEST(DeviceSource, RealDeviceStampsAndCounts) {
  const char* device = std::getenv("BEVEL_V4L2_DEVICE");
  if (device == nullptr) GTEST_SKIP() << "BEVEL_V4L2_DEVICE names no /dev/videoN; nothing of the kernel's was tried";
  SourceConfig config{.kind = SourceKind::device, .path = device};
  if (const char* fourcc = std::getenv("BEVEL_V4L2_FOURCC")) config.fourcc = fourcc;
  const auto source = make_frame_source(config);
  int64_t last_utime = 0, last_seq = -1, lost = 0;
  int on_arrival = 0, frames = 0;
  for (; frames < 30; ++frames) {
    const FrameResult got = source->next(milliseconds(5000));
    ASSERT_TRUE(std::holds_alternative<Frame>(got)) << frames;
    const Frame& frame = std::get<Frame>(got);
    const int64_t age_us = read_clocks().realtime_us - frame.capture_utime;
    EXPECT_GE(age_us, 0);
    EXPECT_LT(age_us, 2'000'000);
    EXPECT_GT(frame.capture_utime, last_utime);
    EXPECT_GT(frame.seq, last_seq);
    EXPECT_EQ(frame.gray.size(), cv::Size(640, 480));
    lost += last_seq >= 0 ? frame.seq - last_seq - 1 : 0;
    last_utime = frame.capture_utime, last_seq = frame.seq;
    on_arrival += frame.stamped_on_arrival ? 1 : 0;
  }
  std::printf("%s: %d frames, %lld lost, %d not stamped by the driver\n", device, frames, static_cast<long long>(lost),
              on_arrival);
}

}  // namespace
}  // namespace bevel::camera
