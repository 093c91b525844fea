// SPDX-License-Identifier: MIT
#pragma once
// bevel-camera: frames in, TIP_MEASUREMENT out, and TIP_HEADING of the same frame, stamp and number for cameras that
// are told to give it. The estimate, if there is one, says where to look.
#include <map>
#include <set>

#include <bevel/drivers/camera/frame_recorder.hpp>
#include <bevel/drivers/camera/pipeline.hpp>
#include <bevel/nodes/camera_pictures.hpp>
#include <bevel/nodes/status_reporter.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::nodes {

// bevel-camera, or bevel-camera-N for one that serves camera N of several.
std::string camera_process_name(const SystemConfig& config);

// What is published of an observation.
tip_measurement_t to_tip(const camera::TipObservation& seen, std::int64_t seq);
tip_heading_t to_heading(const camera::TipObservation& seen, std::int64_t seq);

class CameraNode {
 public:
  // Throws camera::SourceError or ArgumentError, naming what is wrong.
  // `pictures_hz`: how often a camera's picture goes out on CAMERA_PICTURE, at most kMostPictures_hz; 0: never.
  CameraNode(lcm::LCM& lcm, const SystemConfig& config, double pictures_hz = 0);
  enum class Outcome { frame, nothing, ended, failed };
  void tell_time(const Now& now) { port_.tell_time(now); }
  // Waits at most timeout_ms for a frame and publishes what it shows.
  Outcome step(const Now& now, int timeout_ms);
  LcmPort& port() { return port_; }
  // Keeps the frames from here on (frame_recorder.hpp). Throws IoError.
  void record(const std::string& folder);
  // Waits for the disk; then how many were kept and how many not. Empty if nothing is recorded.
  std::string end_recording();
  const std::string& failure() const { return failure_; }
  const camera::CameraCounters& counters() const { return pipeline_->counters(); }
  // Called with each observation, for programs that print them.
  std::function<void(const camera::TipObservation&)> on_observation;

 private:
  // What PROCESS_STATUS says of the frames; empty if there is nothing to say.
  std::string remark() const;

  LcmPort port_;
  std::unique_ptr<camera::CameraPipeline> pipeline_;
  std::unique_ptr<camera::FrameRecorder> recorder_;
  StatusReporter status_;
  std::string failure_, remark_;
  std::int64_t remarked_ns_ = 0;
  std::map<int, std::int64_t> seq_;  // each camera counts for itself
  std::set<int> with_headings_;
  bool latency_known_ = false;                 // of the device's camera
  std::optional<PictureClock> picture_clock_;  // none: no pictures
  const KeptFrame* kept_ = nullptr;            // the pipeline's source; set with picture_clock_
};

}  // namespace bevel::nodes
