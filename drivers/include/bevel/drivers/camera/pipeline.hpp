// SPDX-License-Identifier: MIT
#pragma once
// One source, one tracker per camera: frames in, tip observations out. What bevel-camera wires to LCM.
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/drivers/camera/tip_tracker.hpp>
#include <bevel/drivers/camera/view.hpp>

namespace bevel::camera {

/// One camera's answer to one frame; field for field what tip_measurement_t and tip_heading_t carry, and what a display
/// wants beside it.
struct TipObservation {
  int64_t capture_utime = 0;
  int64_t seq = 0;
  int32_t camera = 0;
  TipStatus status = TipStatus::lost;
  Vector3 position_mm{};          ///< in {A}; zero unless ok
  Matrix3 information_per_mm2{};  ///< zero unless ok, and along the optical axis
  /// The tangent of the shaft's centreline at the tip, as this picture shows it (view.hpp); zero unless heading_status
  /// is ok.
  SeenDirection heading;
  TipStatus heading_status = TipStatus::lost;
  cv::Point2d tip_px;  ///< and the rest: only if ok
  cv::Vec2d direction_px;
  std::string_view reason;  ///< why not ok; static storage
  double run_s = 0;         ///< from the frame to this, without waiting for it
};

struct CameraSetup {
  int32_t camera = 0;
  std::shared_ptr<const View> view;
  TrackerConfig tracker;
  cv::Mat background;      ///< optional picture without a needle
  int64_t latency_us = 0;  ///< taken off the stamps of its frames: by how much they are late
};

struct CameraCounters {
  int64_t frames = 0;
  int64_t lost_frames = 0;  ///< gaps in seq
  int64_t stamped_on_arrival = 0;
  int64_t unknown_camera = 0;  ///< frames of cameras that are not set up; dropped
  std::array<int64_t, kTipStatuses> by_status{};
  int64_t headings = 0;  ///< frames with a usable one
};

class CameraPipeline {
 public:
  using Clock = std::function<int64_t()>;  ///< microseconds since the epoch
  using Result = std::variant<TipObservation, FrameTimeout, EndOfFrames, SourceFailure>;

  /// An empty `clock` means that age has no meaning (files). Throws ArgumentError: no camera, the same number
  /// twice, no view, or a bad tracker configuration, which names the camera.
  CameraPipeline(std::unique_ptr<FrameSource> source, const std::vector<CameraSetup>& cameras, Clock clock = {});

  /// Waits at most `timeout` for a frame of a camera that is set up and tracks it.
  Result next(std::chrono::milliseconds timeout);

  /// Where the estimator expects the tip, in {A}; used once, for the next frame of every camera.
  void predict(const Vector3& position_mm);

  /// Called with each frame that was tracked and what it showed, for who keeps frames; empty by default.
  std::function<void(const cv::Mat& gray, const TipObservation&)> on_tracked;

  const CameraCounters& counters() const { return counters_; }
  /// FrameSource::remark() of its source.
  std::string source_remark() const { return source_->remark(); }

 private:
  struct Eye {
    std::shared_ptr<const View> view;
    TipTracker tracker;
    int64_t latency_us = 0;
    std::optional<int64_t> last_seq;
    std::optional<cv::Point2d> predicted_px;
  };
  TipObservation observe(Eye& eye, const Frame& frame);

  std::unique_ptr<FrameSource> source_;
  std::map<int32_t, Eye> eyes_;
  Clock clock_;
  CameraCounters counters_;
};

}  // namespace bevel::camera
