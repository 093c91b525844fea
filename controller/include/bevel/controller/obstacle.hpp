// SPDX-License-Identifier: MIT
#pragma once
// What the needle must not touch: a capsule, all that lies within a radius of a line between two points; a sphere where
// the two are one. Lengths in mm, in {A}.
#include <Eigen/Core>

namespace bevel::controller {

struct Obstacle {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();  // a sphere: the same point
  double radius_mm = 0;
  double clearance_mm = 0;  // that the tip keeps from its surface
};

// From the surface to the nearest point of the line from a to b; negative inside.
double distance_mm(const Obstacle& obstacle, const Eigen::Vector3d& a_mm, const Eigen::Vector3d& b_mm);
inline double distance_mm(const Obstacle& obstacle, const Eigen::Vector3d& point_mm) {
  return distance_mm(obstacle, point_mm, point_mm);
}

}  // namespace bevel::controller
