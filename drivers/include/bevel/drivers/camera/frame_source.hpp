// SPDX-License-Identifier: MIT
#pragma once
// Port: where frames come from. Adapters are made by make_frame_source() only, so a program names a source in its
// configuration and never sees which class it got.
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include <bevel/drivers/camera/frame.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {

struct FrameTimeout {};
struct EndOfFrames {};
struct SourceFailure {
  std::string text;  ///< names the source and what was wrong; the source gives no more frames after it
};
using FrameResult = std::variant<Frame, FrameTimeout, EndOfFrames, SourceFailure>;

class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Waits at most `timeout`; sources that read files never wait. After EndOfFrames it keeps answering EndOfFrames.
  virtual FrameResult next(std::chrono::milliseconds timeout) = 0;

  /// Describes a property of the frames so far that users should know, such as an orientation tag that is ignored.
  /// Returns an empty text if all frames were ordinary.
  virtual std::string remark() const { return {}; }
};

/// Bad configuration or a source that cannot be opened. what() names the key, the value and what is allowed.
class SourceError : public DeviceError {
  using DeviceError::DeviceError;
};

enum class SourceKind { folder, video, device, stream };

struct SourceConfig {
  SourceKind kind = SourceKind::folder;
  std::string path;            ///< folder; video file; /dev/videoN; Unix socket of the rig's frame server
  int32_t camera = 0;          ///< number given to the frames; ignored by `stream`, whose frames carry it
  int64_t start_utime = 0;     ///< folder and video: stamp of the first frame
  int64_t period_us = 33'333;  ///< folder: time between frames; video: where the file states neither times nor a rate
  int width_px = 640;          ///< device only: requested size and rate; the driver may refuse
  int height_px = 480;
  double rate_hz = 30.0;
  std::string fourcc = "YUYV";    ///< device only: uncompressed by default, MJPEG costs 5.6 ms a frame at 640x480
  int connect_timeout_ms = 2000;  ///< stream only: how long to wait for the server to appear
};

/// Throws SourceError on a bad value or when the source cannot be opened.
std::unique_ptr<FrameSource> make_frame_source(const SourceConfig& config);

/// "folder", "video", "device" or "stream"; throws SourceError naming the four otherwise.
SourceKind source_kind_from(std::string_view name);

/// True if `a` sorts before `b` with runs of digits compared as numbers (frame2 before frame10).
bool natural_less(std::string_view a, std::string_view b);

}  // namespace bevel::camera
