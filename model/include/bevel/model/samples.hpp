// SPDX-License-Identifier: MIT
#pragma once
// What flows between the parts: one plain struct per message, its time first, the unit in every name.
// No part of the core reads a clock: time arrives with the samples.
#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace bevel::model {

/// Values of MotionCommand::mode.
enum class MotionMode : std::int32_t { stop = 0, run = 1 };

enum class AxisStatus : std::int32_t { off = 0, ready = 1, enabled = 2, quick_stop = 3, fault = 4 };

struct TipMeasurement {
  std::int64_t utime = 0;  // us since the epoch, time of capture
  std::int64_t seq = 0;
  std::int32_t camera = 0;
  std::int32_t status = 0;                                        // 0 ok, else why not usable
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();          // tip in {A}
  Eigen::Matrix3d information_per_mm2 = Eigen::Matrix3d::Zero();  // inverse covariance, any rank
};

struct TipHeading {
  std::int64_t utime = 0;  // us since the epoch, time of capture
  std::int64_t seq = 0;
  std::int32_t camera = 0;
  std::int32_t status = 0;                                         // 0 ok, else why not usable
  Eigen::Vector3d heading = Eigen::Vector3d::Zero();               // unit vector in {A}
  Eigen::Matrix3d information_per_rad2 = Eigen::Matrix3d::Zero();  // inverse covariance of its error, zero along it
};

struct ActuatorState {
  std::int64_t utime = 0;  // us since the epoch, time for which the positions hold
  std::int64_t seq = 0;
  std::array<std::int32_t, 2> axis_status{};  // insertion, rotation; see AxisStatus
  double insertion_mm = 0;
  double insertion_rate_mm_s = 0;
  double rotation_rad = 0;
  double rotation_rate_rad_s = 0;
};

struct MotionCommand {
  std::int64_t utime = 0;  // us since the epoch, time of validity
  std::int64_t seq = 0;
  std::int32_t mode = 0;  // see MotionMode
  double insertion_rate_mm_s = 0;
  double rotation_rate_rad_s = 0;
};

}  // namespace bevel::model
