// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The frame {A} of a recording whose tracker frame has another origin and orientation, estimated from the insertion.

#include <Eigen/Geometry>
#include <span>

#include <bevel/model/samples.hpp>

namespace bevel::io {

/// Pose of {A} in the frame of the measurements.
struct EntryFrame {
  Eigen::Quaterniond to_A = Eigen::Quaterniond::Identity();  ///< rotates a vector of the measurements' frame into {A}
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();       ///< origin of {A} in the measurements' frame, mm
  double direction_sd_rad = 0;  ///< standard error of z of {A}, in the less certain direction, rad
  double origin_sd_mm = 0;      ///< largest standard error of the origin, mm
  double radius_mm = 0;         ///< radius of the fitted arc, mm
  double scale = 1;             ///< path length of the tip per mm of insertion
  double rms_mm = 0;            ///< root mean square of the residuals of an axis, mm
  std::size_t tips = 0;         ///< number of measurements that were fitted
};

/// Rotation (rad) of the actuator from which on measurements are not fitted: the arc then leaves its plane.
inline constexpr double kTurnedSinceEntry_rad = 0.1;
/// Length (mm) of the shortest insertion that is fitted.
inline constexpr double kShortestArc_mm = 20;
/// Largest standard error (rad) of the direction.
inline constexpr double kLargestDirectionSd_rad = 0.1;

/// Fits an arc of constant curvature to the measurements before the actuator rotates, and returns the frame at its
/// start.
///
/// Origin, initial direction, curvature and the scale of the insertion are free. The rotation is the smallest one that
/// takes the initial direction to z. The roll about z cannot be determined from positions, and stays that of the
/// measurements' frame.
/// @param actuators  positions of the axes, in order of time; the insertion of the first one is that of the origin
/// @param tips  positions in any right-handed frame whose z leads into the tissue, within 90 degrees; in order of time
/// @return pose of {A} with its standard errors and the residuals
/// @throws ParseError if the measurements do not determine the direction, with the figures and the remedy
EntryFrame fit_entry_frame(std::span<const model::ActuatorState> actuators,
                           std::span<const model::TipMeasurement> tips);

}  // namespace bevel::io
