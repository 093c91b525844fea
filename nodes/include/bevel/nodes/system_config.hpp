// SPDX-License-Identifier: MIT
#pragma once
// One file for a whole rig: every process reads all of it, so that a wrong key is found by whichever starts first, and
// uses its own part. Keys, ranges and defaults stand in system_config.cpp and in the structures named here.
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <bevel/controller/config.hpp>
#include <bevel/drivers/camera/calibration/camera_model.hpp>
#include <bevel/drivers/camera/frame_source.hpp>
#include <bevel/drivers/camera/planar_view.hpp>
#include <bevel/drivers/camera/tracker_config.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>
#include <bevel/estimator/config.hpp>
#include <bevel/io/live_effects.hpp>
#include <bevel/model/beam/beam_plant.hpp>

namespace bevel::nodes {

struct CameraViewConfig {
  int camera = 0;
  camera::PlanarViewConfig view;
  // In its place where the camera has a `calibration`: a file of bevel-calibrate.
  std::optional<camera::CameraModel> calibrated;
  camera::TrackerConfig tracker;
  // Whether the tangent of the shaft's end goes out on TIP_HEADING. Off by default: beside the positions of the same
  // frames it brings the estimate next to nothing (docs/estimator.md), and to who does not know that it is the shaft's
  // it is a wrong heading, by the slip angle. On where the estimate may have to start deep in the tissue.
  bool headings = false;
  // By how much the stamps of its frames are late, as bevel-calibrate --latency finds it; taken off by bevel-camera
  // where frames are live (source.kind device or stream).
  double latency_s = 0;
  int width_px = 640;  // of the rig's rendered picture; of a calibrated camera those of its calibration
  int height_px = 480;
};

// A sensor in the simulated needle that tells the tip's heading, [rig.heading].
struct HeadingSensorConfig {
  double sd_rad = 0;  // to either side; 0: there is none
  double rate_hz = 30;
  int camera = 15;  // the number that it goes by in TIP_HEADING
};

// Limit switches of a simulated drive, closed at and beyond; mm or rad from where the axis stands at the start, in its
// direction. Infinite: none.
struct LimitSwitchConfig {
  double min_unit = -std::numeric_limits<double>::infinity();
  double max_unit = std::numeric_limits<double>::infinity();
};

struct RigConfig {
  // Of the simulated needle: [rig.needle], [[rig.effect]]s, [[rig.discrepancy]]s and [rig.variation], or the model file
  // `model`; unlike [needle] and the rest at the top, which are what the software believes. Without [rig.needle] it is
  // [needle], but nothing else is ever taken over. Unknowns of single recordings are as in the effect's own table; time
  // counts from the start. What the insertion has of its own is drawn from the variation with `seed`.
  model::NeedleParameters truth;
  std::vector<io::EffectEntry> effects;
  std::vector<model::DiscrepancyCurve> discrepancies;
  model::Variation variation;
  // [rig.beam]: the needle is a beam in elastic tissue instead; of the effects those of cameras act on it.
  std::optional<model::BeamPlantConfig> beam;
  double roll_error_rad = 0;  // the bevel's true roll at the start; the software believes zero
  std::string frames_socket = "/tmp/bevel-rig-frames.sock";
  double frame_rate_hz = 30;
  HeadingSensorConfig heading;
  std::array<LimitSwitchConfig, stepper::kAxes> limit_switches;
  double noise_gray = 2;
  double blur_px = 0.8;
  std::int64_t seed = 1;
};

struct SystemConfig {
  std::string lcm_url;  // empty: LCM's default, or LCM_DEFAULT_URL
  std::string can = "unix:/tmp/bevel-rig-can.sock";
  bool realtime = false;  // SCHED_FIFO and locked memory for controller and stepper, where the system permits
  // What the software believes: [needle], [[effect]]s, [[discrepancy]]s and [variation], or the model file `model` at
  // the top of the file. Of the effects, estimator (estimator.effects) and controller have those that are known before
  // an insertion; the variation is in the estimator's prior.
  model::NeedleParameters needle;
  std::vector<io::EffectEntry> effects;
  std::vector<model::DiscrepancyCurve> discrepancies;
  io::LiveEffects live_effects;
  estimator::EstimatorConfig estimator;
  controller::ControllerConfig controller;
  stepper::StepperConfig stepper;
  camera::SourceConfig source;
  std::vector<CameraViewConfig> cameras;
  RigConfig rig;
  std::string text;  // the file as read, for the CONFIG channel
};

// Throws io::ConfigError with every fault of the file.
SystemConfig load_system_config(const std::string& path);

}  // namespace bevel::nodes
