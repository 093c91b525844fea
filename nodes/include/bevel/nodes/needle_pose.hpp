// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Pose in a needle_state_t message: position in {A} and a unit quaternion, w first.
#include <bevel/needle_state_t.hpp>

#include <bevel/model/lie.hpp>

namespace bevel::nodes {

/// Writes a pose into a message.
/// @param pose    pose in {A}, mm
/// @param message message to change
inline void write_pose(const model::Pose& pose, needle_state_t& message) {
  Eigen::Quaterniond q(pose.R);
  q.normalize();
  for (int i = 0; i < 3; ++i) message.position_mm[i] = pose.p_mm[i];
  message.orientation_wxyz[0] = q.w();
  message.orientation_wxyz[1] = q.x();
  message.orientation_wxyz[2] = q.y();
  message.orientation_wxyz[3] = q.z();
}

/// Reads the pose of a message. The quaternion is normalised.
/// @param message message
/// @return pose in {A}, mm
inline model::Pose read_pose(const needle_state_t& message) {
  const double* q = message.orientation_wxyz;
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix(),
          Eigen::Vector3d(message.position_mm[0], message.position_mm[1], message.position_mm[2])};
}

}  // namespace bevel::nodes
