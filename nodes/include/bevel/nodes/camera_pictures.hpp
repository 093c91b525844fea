// SPDX-License-Identifier: MIT
#pragma once
// What cameras see, made small for people to look at: at most a few pictures a second, each with the tip that was found
// in it.
#include <bevel/camera_picture_t.hpp>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/drivers/camera/pipeline.hpp>

namespace bevel::nodes {

inline constexpr double kMostPictures_hz = 5;

// Hands frames on as they come, and keeps the newest.
class KeptFrame : public camera::FrameSource {
 public:
  explicit KeptFrame(std::unique_ptr<camera::FrameSource> source) : source_(std::move(source)) {}
  camera::FrameResult next(std::chrono::milliseconds timeout) override;
  std::string remark() const override { return source_->remark(); }
  const camera::Frame& frame() const { return frame_; }  // empty before the first

 private:
  std::unique_ptr<camera::FrameSource> source_;
  camera::Frame frame_;
};

// A grey JPEG of the frame, at most 320 pixels wide and high, and where the tip is in it. The frame must not be empty.
camera_picture_t make_picture(const camera::Frame& frame, const camera::TipObservation& seen, std::int64_t seq);

// When a camera's next picture is due.
class PictureClock {
 public:
  // Throws ArgumentError unless 0 < rate_hz <= kMostPictures_hz.
  explicit PictureClock(double rate_hz);
  bool due(std::int32_t camera, std::int64_t now_ns);  // true: take it; the next is due one period later

 private:
  std::int64_t period_ns_ = 0;
  std::map<std::int32_t, std::int64_t> next_ns_;
};

}  // namespace bevel::nodes
