// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Configuration of a whole rig in one file. Every process reads the whole file, so that the process that starts first
/// finds a wrong key, and uses its own part. system_config.cpp and the structures named here define keys, ranges and
/// defaults.
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

/// One [[camera]].
struct CameraViewConfig {
  int camera = 0;                 ///< camera number
  camera::PlanarViewConfig view;  ///< view in a plane
  /// Replaces the view if the camera has a `calibration`: a file of bevel-calibrate.
  std::optional<camera::CameraModel> calibrated;
  camera::TrackerConfig tracker;  ///< settings of the tip tracker
  /// Whether the tangent of the shaft's end is published on TIP_HEADING. Off by default: given the positions of the
  /// same frames it barely improves the estimate (docs/estimator.md), and a subscriber that takes it for the heading of
  /// the tip makes an error of the slip angle. Enable it if the estimate may have to start deep in the tissue.
  bool headings = false;
  /// Latency of the time stamps of the frames, s, as bevel-calibrate --latency measures it. bevel-camera subtracts it
  /// from live frames (source.kind device or stream).
  double latency_s = 0;
  /// Width and height of the rig's rendered image, px; a calibrated camera has those of its calibration.
  int width_px = 640;
  int height_px = 480;  ///< height, px
};

/// Sensor in the simulated needle that measures the heading of the tip, [rig.heading].
struct HeadingSensorConfig {
  double sd_rad = 0;    ///< standard deviation in both lateral directions, rad; 0: no sensor
  double rate_hz = 30;  ///< rate of the measurements, Hz
  int camera = 15;      ///< camera number in TIP_HEADING
};

/// Limit switches of a simulated drive, closed at and beyond a position. Positions in mm or rad from the start, in the
/// direction of the axis; infinite: none.
struct LimitSwitchConfig {
  double min_unit = -std::numeric_limits<double>::infinity();  ///< position of the lower switch, mm or rad
  double max_unit = std::numeric_limits<double>::infinity();   ///< position of the upper switch, mm or rad
};

/// Settings of the simulated rig, [rig].
struct RigConfig {
  /// Parameters of the simulated needle: [rig.needle], [[rig.effect]]s, [[rig.discrepancy]]s and [rig.variation], or
  /// the model file `model`; [needle] and the other top-level sections describe what the software assumes. Without
  /// [rig.needle] the parameters are those of [needle]; nothing else is taken over. Unknowns of single recordings are
  /// as in the effect's own table; time counts from the start. The insertion-specific parameters are drawn from the
  /// variation with `seed`.
  model::NeedleParameters truth;
  std::vector<io::EffectEntry> effects;                ///< effects of the simulated needle
  std::vector<model::DiscrepancyCurve> discrepancies;  ///< discrepancy terms of the simulated needle
  model::Variation variation;                          ///< distribution of the insertion-specific parameters
  /// Beam in elastic tissue that replaces the needle, [rig.beam]; only effects on camera images act on it.
  std::optional<model::BeamPlantConfig> beam;
  double roll_error_rad = 0;  ///< true roll of the bevel at the start, rad; the software assumes zero
  std::string frames_socket = "/tmp/bevel-rig-frames.sock";      ///< path of the socket with the frames
  double frame_rate_hz = 30;                                     ///< frame rate, Hz
  HeadingSensorConfig heading;                                   ///< sensor for the heading of the tip
  std::array<LimitSwitchConfig, stepper::kAxes> limit_switches;  ///< limit switches of each axis
  double noise_gray = 2;                                         ///< standard deviation of the image noise, grey levels
  double blur_px = 0.8;                                          ///< standard deviation of the lens blur, px
  std::int64_t seed = 1;                                         ///< seed of noise and variation
};

/// Content of a system file.
struct SystemConfig {
  std::string lcm_url;                               ///< LCM provider; empty: LCM's default, or LCM_DEFAULT_URL
  std::string can = "unix:/tmp/bevel-rig-can.sock";  ///< address of the bus (can::open_bus())
  bool realtime = false;  ///< SCHED_FIFO and locked memory for controller and stepper, if the system permits them
  /// Parameters that the software assumes: [needle], [[effect]]s, [[discrepancy]]s and [variation], or the model file
  /// `model` at the top of the file. Estimator (estimator.effects) and controller use the effects that are known before
  /// an insertion; the variation is part of the estimator's prior.
  model::NeedleParameters needle;
  std::vector<io::EffectEntry> effects;                ///< effects of the assumed model
  std::vector<model::DiscrepancyCurve> discrepancies;  ///< discrepancy terms of the assumed model
  io::LiveEffects live_effects;                        ///< effects that estimator and controller use
  estimator::EstimatorConfig estimator;                ///< settings of the estimator
  controller::ControllerConfig controller;             ///< settings of the controller
  stepper::StepperConfig stepper;                      ///< settings of the stepper driver
  camera::SourceConfig source;                         ///< source of the frames
  std::vector<CameraViewConfig> cameras;               ///< cameras
  RigConfig rig;                                       ///< settings of the simulated rig
  std::string text;                                    ///< text of the file, for the CONFIG channel
};

/// Reads a system file.
/// @param path path of the file
/// @return configuration
/// @throws io::ConfigError listing every fault of the file
SystemConfig load_system_config(const std::string& path);

}  // namespace bevel::nodes
