// SPDX-License-Identifier: MIT
#include <bevel/nodes/camera_node.hpp>

#include <algorithm>
#include <cmath>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/error.hpp>
#include <bevel/io/camera_picture.hpp>

namespace bevel::nodes {

std::string camera_process_name(const SystemConfig& config) {
  const bool all = config.source.kind == camera::SourceKind::stream || config.cameras.size() < 2;
  return all ? "bevel-camera" : "bevel-camera-" + std::to_string(config.source.camera);
}

namespace {
// When, of which camera, and whether to be used: what positions and headings have in common.
template <class Message>
Message stamped(const camera::TipObservation& seen, std::int64_t seq, camera::TipStatus status) {
  Message m{};
  m.utime = seen.capture_utime;
  m.seq = seq;
  m.camera = seen.camera;
  m.status = static_cast<std::int32_t>(status);
  return m;
}
}  // namespace

tip_measurement_t to_tip(const camera::TipObservation& seen, std::int64_t seq) {
  auto m = stamped<tip_measurement_t>(seen, seq, seen.status);
  std::ranges::copy(seen.position_mm, m.position_mm);
  std::ranges::copy(seen.information_per_mm2, m.information_per_mm2);
  return m;
}

tip_heading_t to_heading(const camera::TipObservation& seen, std::int64_t seq) {
  auto m = stamped<tip_heading_t>(seen, seq, seen.heading_status);
  std::ranges::copy(seen.heading.direction, m.heading);
  std::ranges::copy(seen.heading.information_per_rad2, m.information_per_rad2);
  return m;
}

CameraNode::CameraNode(lcm::LCM& lcm, const SystemConfig& config, double pictures_hz)
    : port_(lcm), status_(port_, camera_process_name(config), 0) {
  if (config.cameras.empty()) throw ArgumentError("no [[camera]] in the configuration: at least one is needed");
  // Stamps of files are their own, and those of recorded frames are right already.
  const bool live =
      config.source.kind == camera::SourceKind::device || config.source.kind == camera::SourceKind::stream;
  std::vector<camera::CameraSetup> setups;
  for (const CameraViewConfig& c : config.cameras) {
    if (c.camera == config.source.camera) latency_known_ = c.latency_s != 0;
    if (c.headings) with_headings_.insert(c.camera);
    std::shared_ptr<const camera::View> view;
    if (c.calibrated)
      view = std::make_shared<camera::CalibratedView>(*c.calibrated);
    else
      view = std::make_shared<camera::PlanarView>(c.view);
    setups.push_back({c.camera, std::move(view), c.tracker, {}, live ? std::llround(1e6 * c.latency_s) : 0});
  }
  std::unique_ptr<camera::FrameSource> source = camera::make_frame_source(config.source);
  if (pictures_hz != 0) {
    picture_clock_.emplace(pictures_hz);
    auto kept = std::make_unique<KeptFrame>(std::move(source));
    kept_ = kept.get();
    source = std::move(kept);
  }
  pipeline_ = std::make_unique<camera::CameraPipeline>(std::move(source), setups);
  port_.subscribe<needle_state_t>(
      io::channel::kNeedleState,
      [this](const needle_state_t& m) {
        if (m.health == 0) pipeline_->predict({m.position_mm[0], m.position_mm[1], m.position_mm[2]});
      },
      2);
}

void CameraNode::record(const std::string& folder) {
  recorder_ = std::make_unique<camera::FrameRecorder>(folder);
  pipeline_->on_tracked = [this](const cv::Mat& gray, const camera::TipObservation& o) {
    recorder_->offer(gray, {.utime = o.capture_utime,
                            .seq = o.seq,
                            .camera = o.camera,
                            .status = static_cast<std::int32_t>(o.status),
                            .tip_px = o.tip_px,
                            .file = {}});
  };
}

std::string CameraNode::end_recording() {
  if (!recorder_) return "";
  recorder_->finish();
  const auto counts = recorder_->counts();
  return std::to_string(counts.written) + " frames recorded, " + std::to_string(counts.dropped) + " dropped" +
         (counts.failure.empty() ? "" : "; " + counts.failure);
}

std::string CameraNode::remark() const {
  const camera::CameraCounters& c = pipeline_->counters();
  std::string text = pipeline_->source_remark();
  if (c.lost_frames > 0) text += (text.empty() ? "" : "; ") + (std::to_string(c.lost_frames) + " frames lost");
  if (c.stamped_on_arrival > 0 && !latency_known_)
    text += std::string(text.empty() ? "" : "; ") +
            "the driver tells no capture times, and no latency_s is set (bevel-calibrate --latency)";
  if (!recorder_) return text;
  const auto counts = recorder_->counts();
  if (!counts.failure.empty())
    text += (text.empty() ? "" : "; ") + ("recording has ended: " + counts.failure);
  else if (counts.dropped > 0)
    text += (text.empty() ? "" : "; ") + (std::to_string(counts.dropped) + " frames not recorded");
  return text;
}

CameraNode::Outcome CameraNode::step(const Now& now, int timeout_ms) {
  port_.tell_time(now);
  port_.rethrow();
  const auto result = pipeline_->next(std::chrono::milliseconds(timeout_ms));
  if (status_.name_taken()) {
    failure_ = "another process for the same camera is heard on this network";
    return Outcome::failed;
  }
  constexpr std::int64_t kRemarkPeriod_ns = 500'000'000;  // its counts would make each frame news
  if (now.ns - remarked_ns_ >= kRemarkPeriod_ns) remark_ = remark(), remarked_ns_ = now.ns;
  status_.report(io::ProcessState::running, remark_);
  if (std::holds_alternative<camera::FrameTimeout>(result)) return Outcome::nothing;
  if (std::holds_alternative<camera::EndOfFrames>(result)) return Outcome::ended;
  if (const auto* failure = std::get_if<camera::SourceFailure>(&result)) {
    failure_ = failure->text;
    return Outcome::failed;
  }
  const auto& seen = std::get<camera::TipObservation>(result);
  status_.note_run(seen.run_s);
  const std::int64_t seq = seq_[seen.camera]++;
  port_.publish(io::channel::kTipMeasurement, to_tip(seen, seq));
  if (with_headings_.contains(seen.camera)) port_.publish(io::channel::kTipHeading, to_heading(seen, seq));
  // After what the loop waits for.
  if (picture_clock_ && picture_clock_->due(seen.camera, now.ns))
    port_.publish(io::channel::kCameraPicture, make_picture(kept_->frame(), seen, seq));
  if (on_observation) on_observation(seen);
  return Outcome::frame;
}

}  // namespace bevel::nodes
