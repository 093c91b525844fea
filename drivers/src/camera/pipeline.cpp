// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/pipeline.hpp>

#include <algorithm>
#include <cmath>

#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

std::string text_of(const cv::Size& size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height) + " px";
}

}  // namespace

CameraPipeline::CameraPipeline(std::unique_ptr<FrameSource> source, const std::vector<CameraSetup>& cameras,
                               Clock clock)
    : source_(std::move(source)), clock_(std::move(clock)) {
  if (!source_) throw ArgumentError("camera pipeline: no frame source");
  if (cameras.empty()) throw ArgumentError("camera pipeline: no camera is set up, at least one is needed");
  for (const CameraSetup& setup : cameras) {
    const std::string name = "camera " + std::to_string(setup.camera);
    if (!setup.view) throw ArgumentError(name + ": no view");
    if (eyes_.contains(setup.camera)) throw ArgumentError(name + ": set up twice");
    try {
      Eye eye{setup.view, TipTracker(setup.tracker, setup.view->px_per_mm()), setup.latency_us, {}, {}};
      if (!setup.background.empty()) eye.tracker.set_background(setup.background);
      eyes_.emplace(setup.camera, std::move(eye));
    } catch (const ArgumentError& error) {
      throw ArgumentError(name + ": " + error.what());
    }
  }
}

void CameraPipeline::predict(const Vector3& position_mm) {
  for (auto& [number, eye] : eyes_) {
    const cv::Point2d p = eye.view->pixel(position_mm);
    if (std::isfinite(p.x) && std::isfinite(p.y)) eye.predicted_px = p;
  }
}

CameraPipeline::Result CameraPipeline::next(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    FrameResult got = source_->next(std::max(left, std::chrono::milliseconds(0)));
    if (std::holds_alternative<FrameTimeout>(got)) return FrameTimeout{};
    if (std::holds_alternative<EndOfFrames>(got)) return EndOfFrames{};
    if (auto* failure = std::get_if<SourceFailure>(&got)) return std::move(*failure);
    const Frame& frame = std::get<Frame>(got);
    const auto eye = eyes_.find(frame.camera);
    if (eye != eyes_.end()) {
      if (const auto size = eye->second.view->picture_size(); size && *size != frame.gray.size())
        return SourceFailure{"camera " + std::to_string(frame.camera) + ": a picture is " + text_of(frame.gray.size()) +
                             ", allowed: " + text_of(*size) + ", of which its calibration is; calibrate at this size"};
      const auto begun = std::chrono::steady_clock::now();
      TipObservation seen = observe(eye->second, frame);
      seen.run_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      if (on_tracked) on_tracked(frame.gray, seen);
      return seen;
    }
    ++counters_.unknown_camera;
  }
}

TipObservation CameraPipeline::observe(Eye& eye, const Frame& frame) {
  ++counters_.frames;
  if (eye.last_seq && frame.seq > *eye.last_seq + 1) counters_.lost_frames += frame.seq - *eye.last_seq - 1;
  eye.last_seq = frame.seq;
  counters_.stamped_on_arrival += frame.stamped_on_arrival ? 1 : 0;
  TipResult tip = eye.tracker.track(frame, clock_ ? clock_() : 0, std::exchange(eye.predicted_px, {}));
  Vector3 position_mm{};
  if (tip.status == TipStatus::ok) {
    position_mm = eye.view->position_mm(tip.tip_px);
    if (!std::ranges::all_of(position_mm, [](double x) { return std::isfinite(x); })) {
      tip.status = tip.heading_status = TipStatus::lost;
      tip.reason = "the view has no point for that pixel";
    }
  }
  ++counters_.by_status[static_cast<size_t>(tip.status)];
  TipObservation seen;
  seen.capture_utime = frame.capture_utime - eye.latency_us;
  seen.seq = frame.seq;
  seen.camera = frame.camera;
  seen.status = tip.status;
  seen.heading_status = tip.heading_status;
  seen.reason = tip.reason;
  if (tip.status != TipStatus::ok) return seen;
  seen.position_mm = position_mm;
  seen.information_per_mm2 = eye.view->information_per_mm2(tip.tip_px, tip.covariance_px2);
  seen.tip_px = tip.tip_px;
  seen.direction_px = tip.direction_px;
  if (tip.heading_status != TipStatus::ok) return seen;
  ++counters_.headings;
  seen.heading = eye.view->direction(tip.tip_px, tip.direction_px, tip.direction_variance_rad2);
  return seen;
}

}  // namespace bevel::camera
