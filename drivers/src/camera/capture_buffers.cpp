// SPDX-License-Identifier: MIT
#include <linux/videodev2.h>

#include <algorithm>
#include <ctime>
#include <opencv2/imgproc.hpp>

#include <bevel/drivers/camera/capture_device.hpp>
#include <bevel/drivers/camera/decode.hpp>

namespace bevel::camera {
namespace {

int64_t clock_us(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000;
}

// A driver may flag a clock and stamp by another: an age outside of this is no age.
constexpr int64_t kOldest_us = 2'000'000;
// More frames than this are not lost at once: a counter that began anew.
constexpr uint32_t kLargestGap = 1'000'000;

cv::Mat packed(const PixelLayout& layout, std::span<const uint8_t> bytes, int channels) {
  const size_t row = static_cast<size_t>(layout.width_px) * static_cast<size_t>(channels);
  const auto rows = static_cast<size_t>(layout.height_px);
  if (layout.line_bytes < row || bytes.size() < layout.line_bytes * (rows - 1) + row) return {};
  // OpenCV has no pictures of const bytes; they are only read.
  return {layout.height_px, layout.width_px, CV_8UC(channels), const_cast<uint8_t*>(bytes.data()), layout.line_bytes};
}

}  // namespace

bool is_readable(uint32_t fourcc) {
  static constexpr std::array known = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_UYVY,   V4L2_PIX_FMT_GREY,
                                       V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_YUV420, V4L2_PIX_FMT_MJPEG};
  return std::ranges::find(known, fourcc) != known.end();
}

uint32_t fourcc_from(const std::string& name) {
  uint32_t code = 0;
  for (size_t i = 0; i < 4 && i < name.size(); ++i) code |= uint32_t{static_cast<unsigned char>(name[i])} << (8 * i);
  return code;
}

std::string name_of_fourcc(uint32_t fourcc) {
  std::string name;
  for (int i = 0; i < 4; ++i) name += static_cast<char>((fourcc >> (8 * i)) & 0x7F);
  return name;
}

cv::Mat gray_of(const PixelLayout& layout, std::span<const uint8_t> bytes, int* orientation) {
  cv::Mat gray;
  switch (layout.fourcc) {
    case V4L2_PIX_FMT_GREY:
    case V4L2_PIX_FMT_NV12:    // brightness first, colours behind all of it
    case V4L2_PIX_FMT_YUV420:  // "YU12"
      return packed(layout, bytes, 1).clone();
    case V4L2_PIX_FMT_YUYV:
      if (const cv::Mat picture = packed(layout, bytes, 2); !picture.empty()) cv::extractChannel(picture, gray, 0);
      return gray;
    case V4L2_PIX_FMT_UYVY:
      if (const cv::Mat picture = packed(layout, bytes, 2); !picture.empty()) cv::extractChannel(picture, gray, 1);
      return gray;
    case V4L2_PIX_FMT_MJPEG: {
      const DecodedImage image = decode_gray(bytes);
      if (image.gray.cols != layout.width_px || image.gray.rows != layout.height_px) return gray;
      if (orientation != nullptr) *orientation = image.orientation;
      return image.gray;
    }
    default:
      return gray;
  }
}

ClockPair read_clocks() {
  // The real-time clock is read between two readings of the other, so that being interrupted costs half of it.
  const int64_t before_us = clock_us(CLOCK_MONOTONIC);
  const int64_t realtime_us = clock_us(CLOCK_REALTIME);
  return {(before_us + clock_us(CLOCK_MONOTONIC)) / 2, realtime_us};
}

BufferCount::Stamp BufferCount::count(const CapturedBuffer& buffer, const ClockPair& now) {
  const uint32_t gap = buffer.sequence - last_sequence_;         // wraps as the driver's does
  if (begun_) seq_ += gap >= 1 && gap <= kLargestGap ? gap : 1;  // 0 of drivers that do not count
  begun_ = true;
  last_sequence_ = buffer.sequence;
  const int64_t age_us = now.monotonic_us - buffer.timestamp_us;
  const bool driver = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC &&
                      buffer.timestamp_us > 0 && age_us >= 0 && age_us < kOldest_us;
  return {seq_, driver ? now.realtime_us - age_us : now.realtime_us, driver};
}

}  // namespace bevel::camera
