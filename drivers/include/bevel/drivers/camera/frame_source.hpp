// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Interface of the sources of frames. make_frame_source() creates all adapters, so that a program depends only on this
/// interface.
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

/// No frame arrived within the timeout.
struct FrameTimeout {};
/// All frames of a file or folder were read.
struct EndOfFrames {};
/// The source failed and gives no more frames.
struct SourceFailure {
  std::string text;  ///< names the source and what is wrong
};
/// Result of FrameSource::next().
using FrameResult = std::variant<Frame, FrameTimeout, EndOfFrames, SourceFailure>;

/// Source of frames.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Returns the next frame. After EndOfFrames the result is always EndOfFrames.
  /// @param timeout longest wait; sources that read files never wait
  /// @return frame, FrameTimeout, EndOfFrames or SourceFailure
  virtual FrameResult next(std::chrono::milliseconds timeout) = 0;

  /// Describes a property of the frames so far that users should know, such as an orientation tag that is ignored.
  /// @return text; empty if all frames were ordinary
  virtual std::string remark() const { return {}; }
};

/// Wrong configuration, or a source that cannot be opened. what() names the key, the value and what is allowed.
class SourceError : public DeviceError {
  using DeviceError::DeviceError;
};

/// Kind of a source.
enum class SourceKind {
  folder,  ///< images in a folder
  video,   ///< video file
  device,  ///< Video4Linux device
  stream   ///< frame server of the rig
};

/// Settings of a source.
struct SourceConfig {
  SourceKind kind = SourceKind::folder;  ///< kind of the source
  std::string path;                      ///< folder; video file; /dev/videoN; UNIX socket of the rig's frame server
  /// Camera number of the frames; not used for `stream`, whose frames contain it.
  int32_t camera = 0;
  int64_t start_utime = 0;  ///< folder and video: time of the first frame, us since the epoch
  /// Folder: time between frames, us; video: the same if the file states neither times nor a rate.
  int64_t period_us = 33'333;
  int width_px = 640;     ///< device only: requested width, px; the driver may reject it
  int height_px = 480;    ///< device only: requested height, px
  double rate_hz = 30.0;  ///< device only: requested frame rate, Hz
  /// Device only: pixel format. Uncompressed by default, because MJPEG takes 5.6 ms per frame at 640x480.
  std::string fourcc = "YUYV";
  /// Stream only: longest time until the server appears, ms.
  int connect_timeout_ms = 2000;
};

/// Opens a source.
/// @param config settings
/// @return source
/// @throws SourceError if a value is wrong or the source cannot be opened
std::unique_ptr<FrameSource> make_frame_source(const SourceConfig& config);

/// Parses the kind of a source.
/// @param name "folder", "video", "device" or "stream"
/// @return kind
/// @throws SourceError naming the four kinds if the name is another one
SourceKind source_kind_from(std::string_view name);

/// Compares names with runs of digits as numbers (frame2 before frame10).
/// @param a name
/// @param b name
/// @return true if `a` sorts before `b`
bool natural_less(std::string_view a, std::string_view b);

}  // namespace bevel::camera
