// SPDX-License-Identifier: MIT
#pragma once
// Port between a camera's frames and Video4Linux, and what is made of its buffers: pure but for the port's adapter.
// Source: Linux media API, struct v4l2_buffer, "Buffer flags" and "Buffer timestamp".
#include <chrono>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include <bevel/drivers/camera/frame_source.hpp>

namespace bevel::camera {

/// A filled buffer; `bytes` live until it is given back.
struct CapturedBuffer {
  uint32_t index = 0;
  uint32_t flags = 0;        ///< V4L2_BUF_FLAG_*
  uint32_t sequence = 0;     ///< counts frames at the sensor; a gap is a frame that got no buffer
  int64_t timestamp_us = 0;  ///< on the clock that the flags name
  std::span<const uint8_t> bytes;
};

/// How the pixels lie in a buffer.
struct PixelLayout {
  uint32_t fourcc = 0;
  int width_px = 0;
  int height_px = 0;
  size_t line_bytes = 0;  ///< from one row to the next; 0 of compressed formats
};

struct NothingYet {};
struct DeviceGone {
  std::string text;
};

class CaptureDevice {
 public:
  CaptureDevice() = default;
  CaptureDevice(const CaptureDevice&) = delete;
  CaptureDevice& operator=(const CaptureDevice&) = delete;
  virtual ~CaptureDevice() = default;

  virtual const PixelLayout& layout() const = 0;
  /// False if no buffer was filled within that time.
  virtual bool wait(std::chrono::milliseconds timeout) = 0;
  virtual std::variant<CapturedBuffer, NothingYet, DeviceGone> take() = 0;
  virtual void give_back(uint32_t index) = 0;
};

/// Throws SourceError naming the device, what was asked of it and what it offers.
std::unique_ptr<CaptureDevice> open_video4linux(const SourceConfig& config);

/// Formats whose brightness is read: YUYV, UYVY, GREY, NV12, YU12, MJPG.
bool is_readable(uint32_t fourcc);
uint32_t fourcc_from(const std::string& name);
std::string name_of_fourcc(uint32_t fourcc);

/// Returns the brightness of a frame, CV_8UC1, as a copy; empty if there are fewer bytes than the layout needs or the
/// JPEG cannot be decoded.
/// @param orientation receives the EXIF orientation of an MJPEG frame, 1 to 8, which is not applied; may be null
cv::Mat gray_of(const PixelLayout& layout, std::span<const uint8_t> bytes, int* orientation = nullptr);

/// Both clocks at one moment.
struct ClockPair {
  int64_t monotonic_us = 0;
  int64_t realtime_us = 0;  ///< since the epoch
};
ClockPair read_clocks();

/// Number and time of each buffer, over the life of a stream.
class BufferCount {
 public:
  struct Stamp {
    int64_t seq = 0;
    int64_t utime = 0;    ///< microseconds since the epoch
    bool driver = false;  ///< by the driver; else of arrival, which is late by an unknown time
  };
  /// To be called for every buffer, damaged ones too. `now`: when it was taken from the device.
  Stamp count(const CapturedBuffer& buffer, const ClockPair& now);

 private:
  bool begun_ = false;
  uint32_t last_sequence_ = 0;
  int64_t seq_ = 0;
};

}  // namespace bevel::camera
