// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// bevel-camera: subscribes to frames, publishes TIP_MEASUREMENT and, for cameras with `headings`, TIP_HEADING with the
/// time stamp and number of the frame. An estimate, if available, determines the search region.
#include <map>
#include <set>

#include <bevel/drivers/camera/frame_recorder.hpp>
#include <bevel/drivers/camera/pipeline.hpp>
#include <bevel/nodes/camera_pictures.hpp>
#include <bevel/nodes/status_reporter.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::nodes {

/// Returns the process name.
/// @param config system file
/// @return "bevel-camera", or "bevel-camera-N" for a process that serves camera N of several
std::string camera_process_name(const SystemConfig& config);

/// Converts an observation to a TIP_MEASUREMENT message.
/// @param seen observation of one frame
/// @param seq  number of the message
/// @return message, position in {A}, mm
tip_measurement_t to_tip(const camera::TipObservation& seen, std::int64_t seq);
/// Converts an observation to a TIP_HEADING message.
/// @param seen observation of one frame
/// @param seq  number of the message
/// @return message, unit vector in {A}
tip_heading_t to_heading(const camera::TipObservation& seen, std::int64_t seq);

/// Node of the process bevel-camera.
class CameraNode {
 public:
  /// Opens the source of the frames.
  /// @param lcm         LCM; must outlive the node
  /// @param config      system file
  /// @param pictures_hz rate of the images on CAMERA_PICTURE, Hz, at most kMostPictures_hz; 0: none
  /// @throws camera::SourceError if the source cannot be opened
  /// @throws ArgumentError naming the setting that is wrong
  CameraNode(lcm::LCM& lcm, const SystemConfig& config, double pictures_hz = 0);
  /// Result of step().
  enum class Outcome {
    frame,    ///< a frame was processed
    nothing,  ///< no frame arrived
    ended,    ///< the frames have ended
    failed    ///< the source failed, or another process serves the camera
  };
  /// Sets the time at which messages are processed.
  /// @param now present time
  void tell_time(const Now& now) { port_.tell_time(now); }
  /// Waits for a frame and publishes its measurement.
  /// @param now        present time
  /// @param timeout_ms longest wait, ms
  /// @return result; failure() describes Outcome::failed
  Outcome step(const Now& now, int timeout_ms);
  /// @return port of the node
  LcmPort& port() { return port_; }
  /// Records the frames from now on (frame_recorder.hpp).
  /// @param folder folder to write to
  /// @throws IoError if the folder cannot be written
  void record(const std::string& folder);
  /// Waits until the recorded frames are written.
  /// @return numbers of recorded and dropped frames in one sentence; empty if there is no recording
  std::string end_recording();
  /// @return reason of the last Outcome::failed
  const std::string& failure() const { return failure_; }
  /// @return counters since construction
  const camera::CameraCounters& counters() const { return pipeline_->counters(); }
  /// Called with each observation, for programs that print them.
  std::function<void(const camera::TipObservation&)> on_observation;

 private:
  // Returns the remark on the frames for PROCESS_STATUS; may be empty.
  std::string remark() const;

  LcmPort port_;
  std::unique_ptr<camera::CameraPipeline> pipeline_;
  std::unique_ptr<camera::FrameRecorder> recorder_;
  StatusReporter status_;
  std::string failure_, remark_;
  std::int64_t remarked_ns_ = 0;
  std::map<int, std::int64_t> seq_;  // by camera
  std::set<int> with_headings_;
  bool latency_known_ = false;                 // of the device's camera
  std::optional<PictureClock> picture_clock_;  // none: no pictures
  const KeptFrame* kept_ = nullptr;            // the pipeline's source; set with picture_clock_
};

}  // namespace bevel::nodes
