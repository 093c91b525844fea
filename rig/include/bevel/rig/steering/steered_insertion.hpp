// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One steered insertion in simulated time: a plant with cameras and axes, and the estimator and controller of the live
/// system, whose model may differ from the plant. Uses no clock and no messages; a seed determines the run.

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <bevel/controller/supervisor.hpp>
#include <bevel/estimator/config.hpp>
#include <bevel/rig/plant/plant.hpp>
#include <bevel/rig/steering/baseline_steering.hpp>

namespace bevel::rig {

/// One direction in which one camera measures the tip.
struct SeenAxis {
  int camera = 0;        ///< camera number
  Eigen::Vector3d axis;  ///< unit vector in {A}
  double sd_mm = 0;      ///< standard deviation of one measurement, mm
};

/// Simulated cameras.
struct Cameras {
  std::vector<SeenAxis> axes;  ///< measured directions of all cameras
  double ar1 = 0;              ///< correlation of the errors of consecutive frames
  double outlier_share = 0;    ///< fraction of messages that are off by 3 to 10 mm in a random direction
  double frame_s = 1.0 / 30;   ///< frame period, s
  double transport_s = 0.05;   ///< from the exposure of a frame to its measurement, s
  Eigen::Vector3d turned_rad = Eigen::Vector3d::Zero();  ///< rotation vector from {A} to the frame of the cameras, rad
};

/// The simulated rig, unknown to the software under test.
struct SteeredRig {
  std::function<std::unique_ptr<rig::Plant>()> make_plant;  ///< creates the plant of one insertion
  Cameras cameras;                                          ///< cameras of the rig
  /// Target in {A}, mm, at a time in s after the start command; empty: the target is stationary where it was commanded.
  std::function<Eigen::Vector3d(double time_s)> target_mm{};
};

/// Model and settings of the software under test.
struct Believed {
  estimator::EstimatorConfig estimator;       ///< settings of the estimator
  controller::ControllerConfig controller{};  ///< settings of the controller
  /// Effects between actuator and tip that the controller compensates. It uses those of the estimator in any case.
  std::vector<model::ActiveEffect> undone{};
  std::vector<Eigen::Vector3d> way_points_mm{};  ///< way-points in {A}, mm, commanded before the target
  /// A first target, before the target itself.
  struct Before {
    Eigen::Vector3d target_mm;  ///< first target in {A}, mm
    double drawn_back_mm = 0;   ///< length by which the needle is retracted there, mm
  };
  std::optional<Before> before{};  ///< first target; empty: none
  /// Law that replaces the controller; for one target without way-points, obstacles or first target.
  std::optional<BaselineLaw> baseline{};
};

/// Cause of an insertion that ended before the depth of its target.
struct StopCause {
  /// Reason of the controller, with the quantity for an unhealthy estimate and the cause for a reset.
  std::string reason;
  double value = 0;     ///< value of the quantity behind the reason, in `unit`
  double limit = 0;     ///< largest allowed value; 0: the reason has none
  std::string unit;     ///< unit of value and limit
  double depth_mm = 0;  ///< z of the true tip in {A}, mm
};

/// Result of one steered insertion. "True" refers to the plant.
struct Insertion {
  double miss_mm = 0;  ///< distance of the true tip from the target where it stopped, mm
  /// The needle came to the closest approach to the target and stopped there, at any distance from it.
  bool at_depth = false;
  /// Outcome that the controller reports at depth; not set for a baseline law.
  controller::Miss reported;
  controller::Reason reason = controller::Reason::none;  ///< reason of the controller's state at the end
  std::optional<StopCause> stopped{};                    ///< empty for an insertion at depth
  double turned_frame_said_mm = 0;  ///< inserted length at which a turned camera frame was reported, mm; 0: it was not
  double estimate_error_mm = 0;     ///< distance of the estimate from the true tip at the end, mm
  /// Normalised estimation error squared of the pose at the end, six degrees of freedom; 6 on average if the covariance
  /// of the estimate is right.
  double pose_nees = 0;
  double turned_rad = 0;  ///< accumulated absolute rotation of the rotation axis, rad
  /// Least distance of the true tip from the surface of any obstacle, mm; negative inside, infinite without an
  /// obstacle.
  double nearest_mm = std::numeric_limits<double>::infinity();
  double way_point_miss_mm = 0;  ///< largest of the least distances of the true tip from the way-points, mm
  double before_miss_mm = 0,     ///< distance of the true tip from the first target, mm
      off_the_path_mm = 0,       ///< largest distance of the retracted true tip from its insertion path, mm
      drawn_back_error_mm = 0;   ///< largest distance of the estimate from the true tip during the retraction, mm
  double inserted_mm = 0,        ///< inserted length at the end, mm
      duration_s = 0;            ///< time from the start command to the stop, s
};

/// Simulates one steered insertion.
/// @param rig          simulated rig
/// @param believed     model and settings of the software under test
/// @param target_mm    target in {A}, mm
/// @param seed         seed of the measurement noise
/// @param told_the_tip true: the controller receives the true pose of the tip instead of the estimate's, and the
///   parameters as estimated; the remaining error is not caused by the camera
/// @return result of the insertion
Insertion steer(const SteeredRig& rig, const Believed& believed, const Eigen::Vector3d& target_mm, std::uint64_t seed,
                bool told_the_tip = false);

}  // namespace bevel::rig
