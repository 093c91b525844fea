// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One source of frames and one tracker per camera, as bevel-camera connects them to LCM.
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

/// Result of one camera for one frame: the fields of tip_measurement_t and tip_heading_t, and additional ones for
/// displays.
struct TipObservation {
  int64_t capture_utime = 0;           ///< time of exposure minus latency, us since the epoch
  int64_t seq = 0;                     ///< number of the frame
  int32_t camera = 0;                  ///< camera number
  TipStatus status = TipStatus::lost;  ///< status of the position
  Vector3 position_mm{};               ///< tip in {A}, mm; zero unless ok
  Matrix3 information_per_mm2{};       ///< 1/mm^2; zero unless ok, and along the optical axis
  /// Tangent of the shaft's centreline at the tip, as measured in this image (view.hpp); zero unless heading_status
  /// is ok.
  SeenDirection heading;
  TipStatus heading_status = TipStatus::lost;  ///< status of the heading
  cv::Point2d tip_px;                          ///< tip, pixel (u, v); valid only if ok
  cv::Vec2d direction_px;                      ///< unit vector of the shaft in the image; valid only if ok
  std::string_view reason;                     ///< reason of a status other than ok; static storage
  double run_s = 0;                            ///< processing time of the frame, s
};

/// One camera of a pipeline.
struct CameraSetup {
  int32_t camera = 0;                ///< camera number
  std::shared_ptr<const View> view;  ///< geometry of the camera
  TrackerConfig tracker;             ///< settings of the tracker
  cv::Mat background;                ///< image without a needle; may be empty
  int64_t latency_us = 0;            ///< latency of the time stamps of its frames, us; subtracted
};

/// Counters of a pipeline since construction.
struct CameraCounters {
  int64_t frames = 0;                             ///< frames of cameras that are set up
  int64_t lost_frames = 0;                        ///< gaps in seq
  int64_t stamped_on_arrival = 0;                 ///< frames without a time of exposure
  int64_t unknown_camera = 0;                     ///< frames of cameras that are not set up; dropped
  std::array<int64_t, kTipStatuses> by_status{};  ///< frames by TipStatus
  int64_t headings = 0;                           ///< frames with a usable heading
};

/// Tracks the tip in the frames of a source.
class CameraPipeline {
 public:
  /// Returns the present time, us since the epoch.
  using Clock = std::function<int64_t()>;
  /// Result of next().
  using Result = std::variant<TipObservation, FrameTimeout, EndOfFrames, SourceFailure>;

  /// Creates a pipeline.
  /// @param source  source of the frames
  /// @param cameras cameras
  /// @param clock   clock; empty if age has no meaning (files)
  /// @throws ArgumentError if there is no source or camera, a camera number occurs twice, a camera has no view, or a
  /// tracker
  ///   configuration is wrong; the message names the camera
  CameraPipeline(std::unique_ptr<FrameSource> source, const std::vector<CameraSetup>& cameras, Clock clock = {});

  /// Waits for a frame of a camera that is set up, and tracks it.
  /// @param timeout longest wait
  /// @return observation, or the source's FrameTimeout, EndOfFrames or SourceFailure
  Result next(std::chrono::milliseconds timeout);

  /// Sets the tip that the estimator expects; used once, for the next frame of every camera.
  /// @param position_mm tip in {A}, mm
  void predict(const Vector3& position_mm);

  /// Called with each tracked frame and its observation, for recorders; empty by default.
  std::function<void(const cv::Mat& gray, const TipObservation&)> on_tracked;

  /// @return counters since construction
  const CameraCounters& counters() const { return counters_; }
  /// @return FrameSource::remark() of the source
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
