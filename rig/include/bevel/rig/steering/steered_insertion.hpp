// SPDX-License-Identifier: MIT
// One steered insertion in simulated time: a plant with its cameras and axes, and the estimator and the controller as
// they run live, with a model of their own. No clock, no messages; the same seed gives the same run.
#pragma once

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

// One direction in which one camera sees the tip.
struct SeenAxis {
  int camera = 0;
  Eigen::Vector3d axis;  // unit vector in {A}
  double sd_mm = 0;      // of one reading
};

struct Cameras {
  std::vector<SeenAxis> axes;
  double ar1 = 0;            // correlation of the errors of neighbouring frames
  double outlier_share = 0;  // of messages, off by 3 to 10 mm in any direction
  double frame_s = 1.0 / 30;
  double transport_s = 0.05;                             // from the picture to its measurement
  Eigen::Vector3d turned_rad = Eigen::Vector3d::Zero();  // rotation vector by which their frame is off {A}
};

// What the software is not told.
struct SteeredRig {
  std::function<std::unique_ptr<rig::Plant>()> make_plant;
  Cameras cameras;
  // Where the target is so many seconds after the word to go; none: where it was said to be.
  std::function<Eigen::Vector3d(double time_s)> target_mm{};
};

// What the software believes, and how it is set.
struct Believed {
  estimator::EstimatorConfig estimator;
  controller::ControllerConfig controller{};
  // Effects between base and tip that the controller undoes; those of the estimator it follows in any case.
  std::vector<model::ActiveEffect> undone{};
  std::vector<Eigen::Vector3d> way_points_mm{};  // told before the target
  // Before the target another, and drawn back by so much there.
  struct Before {
    Eigen::Vector3d target_mm;
    double drawn_back_mm = 0;
  };
  std::optional<Before> before{};
  // In place of the controller; of a target alone, without way-points, obstacles or one before.
  std::optional<BaselineLaw> baseline{};
};

/// Cause of an insertion that ended before the depth of its target.
struct StopCause {
  /// The controller's reason; of an unhealthy estimate also the quantity, of a reset its cause.
  std::string reason;
  double value = 0;  ///< of the quantity behind the reason
  double limit = 0;  ///< largest allowed; 0: the reason has none
  std::string unit;
  double depth_mm = 0;  ///< z of the true tip
};

struct Insertion {
  double miss_mm = 0;     // true tip to target where it came to rest
  bool at_depth = false;  ///< it came to the closest approach to the target and stopped there, near it or not
  /// The outcome that the controller reports at depth; of a law it is compared with, by the same rule.
  controller::Miss reported;
  controller::Reason reason = controller::Reason::none;  ///< of the controller's state at the end
  std::optional<StopCause> stopped{};                    ///< none of an insertion at depth
  double turned_frame_said_mm = 0;                       // of insertion; 0: it was not
  double estimate_error_mm = 0;                          // estimate to true tip, at the end
  double pose_nees = 0;   // at the end, of six degrees of freedom: one each if the estimate's covariance is right
  double turned_rad = 0;  // of the base, both ways together
  // Least distance of the true tip from any obstacle's surface, negative inside; infinite where there is none.
  double nearest_mm = std::numeric_limits<double>::infinity();
  double way_point_miss_mm = 0;  // the farthest of them, true tip to point where it was nearest
  // Of one that went to a target before and was drawn back: there, and the farthest on the way back of the true tip
  // from where it was on the way in, and of the estimate from the true tip.
  double before_miss_mm = 0, off_the_path_mm = 0, drawn_back_error_mm = 0;
  double inserted_mm = 0, duration_s = 0;  // from the word to go until it stopped
};

// told_the_tip: the controller sees the true tip instead of the estimate's, its parameters as they are estimated: what
// is left is not the camera's.
Insertion steer(const SteeredRig& rig, const Believed& believed, const Eigen::Vector3d& target_mm, std::uint64_t seed,
                bool told_the_tip = false);

}  // namespace bevel::rig
