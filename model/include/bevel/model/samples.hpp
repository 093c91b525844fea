// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Messages between the modules: one plain struct per message, the time stamp first, the unit in every name.
/// No function of the model, estimator or controller reads a clock; the time arrives with the samples.
#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace bevel::model {

/// Values of MotionCommand::mode.
enum class MotionMode : std::int32_t {
  stop = 0,  ///< the axes stop
  run = 1    ///< the axes follow the commanded rates
};

/// Values of ActuatorState::axis_status.
enum class AxisStatus : std::int32_t {
  off = 0,         ///< the drive is off
  ready = 1,       ///< the drive is ready but not enabled
  enabled = 2,     ///< the drive accepts commands
  quick_stop = 3,  ///< the drive performs a quick stop
  fault = 4        ///< the drive reports a fault
};

/// Position of the needle tip measured by a camera or tracker.
struct TipMeasurement {
  std::int64_t utime = 0;                                         ///< time of capture, us since the epoch
  std::int64_t seq = 0;                                           ///< sequence number
  std::int32_t camera = 0;                                        ///< number of the camera
  std::int32_t status = 0;                                        ///< 0: valid; otherwise the reason for rejection
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();          ///< tip in {A}, mm
  Eigen::Matrix3d information_per_mm2 = Eigen::Matrix3d::Zero();  ///< inverse covariance in {A}, 1/mm^2, any rank
};

/// Measured heading of the needle tip. A sensor in the needle measures the needle's own axis e3. A camera measures the
/// tangent of the shaft's centreline at the tip, which is the tip's direction of motion. The two differ by the slip
/// angle.
struct TipHeading {
  std::int64_t utime = 0;                             ///< time of capture, us since the epoch
  std::int64_t seq = 0;                               ///< sequence number
  std::int32_t camera = 0;                            ///< number of the camera or sensor
  std::int32_t status = 0;                            ///< 0: valid; otherwise the reason for rejection
  Eigen::Vector3d heading = Eigen::Vector3d::Zero();  ///< unit vector in {A}, into the tissue
  /// Inverse covariance of the direction error in {A}, 1/rad^2; zero along the heading and along an axis that a camera
  /// cannot see.
  Eigen::Matrix3d information_per_rad2 = Eigen::Matrix3d::Zero();
};

/// State of both actuator axes.
struct ActuatorState {
  std::int64_t utime = 0;                     ///< time at which the positions are valid, us since the epoch
  std::int64_t seq = 0;                       ///< sequence number
  std::array<std::int32_t, 2> axis_status{};  ///< insertion, rotation; values of AxisStatus
  double insertion_mm = 0;                    ///< position of the insertion axis, mm
  double insertion_rate_mm_s = 0;             ///< velocity of the insertion axis, mm/s
  double rotation_rad = 0;                    ///< position of the rotation axis, rad
  double rotation_rate_rad_s = 0;             ///< velocity of the rotation axis, rad/s
};

/// Velocity command for both actuator axes.
struct MotionCommand {
  std::int64_t utime = 0;          ///< time of validity, us since the epoch
  std::int64_t seq = 0;            ///< sequence number
  std::int32_t mode = 0;           ///< a value of MotionMode
  double insertion_rate_mm_s = 0;  ///< commanded insertion velocity, mm/s
  double rotation_rate_rad_s = 0;  ///< commanded rotation velocity, rad/s
};

}  // namespace bevel::model
