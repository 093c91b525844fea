// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Small images of the cameras for display: at most a few per second, each with the detected tip.
#include <bevel/camera_picture_t.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/drivers/camera/pipeline.hpp>

namespace bevel::nodes {

inline constexpr double kMostPictures_hz = 5;  ///< largest rate of images, Hz

/// Frame source that passes on the frames of another source and keeps the newest one.
class KeptFrame : public camera::FrameSource {
 public:
  /// Wraps a source.
  /// @param source source of the frames; not null
  explicit KeptFrame(std::unique_ptr<camera::FrameSource> source) : source_(std::move(source)) {}
  camera::FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return source_->remark(); }
  /// @return newest frame; empty before the first
  const camera::Frame& frame() const { return frame_; }

 private:
  std::unique_ptr<camera::FrameSource> source_;
  camera::Frame frame_;
};

/// Encodes a frame as a grey JPEG of at most 320 pixels in width and height, with the position of the tip in it.
/// @param frame frame; not empty
/// @param seen  observation of the frame
/// @param seq   number of the message
/// @return message for CAMERA_PICTURE
camera_picture_t make_picture(const camera::Frame& frame, const camera::TipObservation& seen, std::int64_t seq);

/// Determines when the next image of each camera is due.
class PictureClock {
 public:
  /// Creates a clock.
  /// @param rate_hz rate of the images of each camera, Hz
  /// @throws ArgumentError unless 0 < rate_hz <= kMostPictures_hz
  explicit PictureClock(double rate_hz);
  /// Returns whether an image is due; if so, the next one is due one period later.
  /// @param camera camera number
  /// @param now_ns steady clock, ns
  /// @return true if an image is to be published now
  bool due(std::int32_t camera, std::int64_t now_ns);

 private:
  std::int64_t period_ns_ = 0;
  std::map<std::int32_t, std::int64_t> next_ns_;
};

}  // namespace bevel::nodes
