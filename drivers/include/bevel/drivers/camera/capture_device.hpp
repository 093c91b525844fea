// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Interface between the frames of a camera and Video4Linux, and the evaluation of its buffers. Only the adapter behind
/// open_video4linux() accesses the device.
/// Source: Linux media API, struct v4l2_buffer, "Buffer flags" and "Buffer timestamp".
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

/// A filled buffer; `bytes` are valid until it is given back.
struct CapturedBuffer {
  uint32_t index = 0;  ///< number of the buffer, for give_back()
  uint32_t flags = 0;  ///< V4L2_BUF_FLAG_*
  /// Number of the frame at the sensor; a gap is a frame without a buffer.
  uint32_t sequence = 0;
  /// Time stamp, us, on the clock that the flags name.
  int64_t timestamp_us = 0;
  std::span<const uint8_t> bytes;  ///< content
};

/// Arrangement of the pixels in a buffer.
struct PixelLayout {
  uint32_t fourcc = 0;    ///< pixel format, V4L2_PIX_FMT_*
  int width_px = 0;       ///< width, px
  int height_px = 0;      ///< height, px
  size_t line_bytes = 0;  ///< bytes from one row to the next; 0 for compressed formats
};

/// No buffer is filled.
struct NothingYet {};
/// The device failed.
struct DeviceGone {
  std::string text;  ///< reason
};

/// A camera that fills buffers.
class CaptureDevice {
 public:
  CaptureDevice() = default;
  CaptureDevice(const CaptureDevice&) = delete;
  CaptureDevice& operator=(const CaptureDevice&) = delete;
  virtual ~CaptureDevice() = default;

  /// @return arrangement of the pixels
  virtual const PixelLayout& layout() const = 0;
  /// Waits for a filled buffer.
  /// @param timeout longest wait
  /// @return false if no buffer was filled within that time
  virtual bool wait(std::chrono::milliseconds timeout) = 0;
  /// Takes a filled buffer; give_back() returns it. Never blocks.
  /// @return buffer, NothingYet or DeviceGone
  virtual std::variant<CapturedBuffer, NothingYet, DeviceGone> take() = 0;
  /// Returns a buffer to the device.
  /// @param index number of the buffer
  virtual void give_back(uint32_t index) = 0;
};

/// Opens a camera and starts the capture.
/// @param config device, size, rate and pixel format
/// @return camera
/// @throws SourceError naming the device, the request and what the device offers
std::unique_ptr<CaptureDevice> open_video4linux(const SourceConfig& config);

/// Returns whether gray_of() supports a pixel format: YUYV, UYVY, GREY, NV12, YU12, MJPG.
/// @param fourcc pixel format
/// @return true if it is supported
bool is_readable(uint32_t fourcc);
/// Encodes a pixel format.
/// @param name name of four characters
/// @return code
uint32_t fourcc_from(const std::string& name);
/// Decodes a pixel format.
/// @param fourcc code
/// @return name of four characters
std::string name_of_fourcc(uint32_t fourcc);

/// Computes the brightness of a frame.
/// @param layout      arrangement of the pixels
/// @param bytes       content of the buffer
/// @param orientation receives the EXIF orientation of an MJPEG frame, 1 to 8, which is not applied; may be null
/// @return brightness, CV_8UC1, as a copy; empty if there are fewer bytes than the layout needs or the JPEG cannot be
///   decoded
cv::Mat gray_of(const PixelLayout& layout, std::span<const uint8_t> bytes, int* orientation = nullptr);

/// Both clocks at one time.
struct ClockPair {
  int64_t monotonic_us = 0;  ///< CLOCK_MONOTONIC, us
  int64_t realtime_us = 0;   ///< us since the epoch
};
/// Reads both clocks.
/// @return present time
ClockPair read_clocks();

/// Computes number and time of each buffer of a stream.
class BufferCount {
 public:
  /// Number and time of a frame.
  struct Stamp {
    int64_t seq = 0;    ///< number of the frame; a gap is a lost frame
    int64_t utime = 0;  ///< us since the epoch
    /// true: time of the driver. false: time of arrival, which is delayed by an unknown time.
    bool driver = false;
  };
  /// Evaluates a buffer. Call it for every buffer, including damaged ones.
  /// @param buffer buffer
  /// @param now    time at which it was taken from the device
  /// @return number and time
  Stamp count(const CapturedBuffer& buffer, const ClockPair& now);

 private:
  bool begun_ = false;
  uint32_t last_sequence_ = 0;
  int64_t seq_ = 0;
};

}  // namespace bevel::camera
