// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Obstacles that the needle must not touch.
#include <Eigen/Core>

namespace bevel::controller {

/// Capsule: all points within a radius of a line segment. It is a sphere if the ends of the segment coincide.
struct Obstacle {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();  ///< first end of the segment, {A}, mm
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();    ///< second end of the segment, {A}, mm
  double radius_mm = 0;                               ///< radius, mm
  double clearance_mm = 0;                            ///< smallest distance from the tip to the surface, mm
};

/// Computes the distance from the surface of an obstacle to a line segment (Ericson, Real-Time Collision Detection,
/// 2005, 5.1.9).
/// @param obstacle the obstacle
/// @param a_mm first end of the segment, {A}, mm
/// @param b_mm second end of the segment, {A}, mm
/// @return distance to the nearest point of the segment, mm; negative inside the obstacle
double distance_mm(const Obstacle& obstacle, const Eigen::Vector3d& a_mm, const Eigen::Vector3d& b_mm);
/// Computes the distance from the surface of an obstacle to a point.
/// @param obstacle the obstacle
/// @param point_mm the point, {A}, mm
/// @return distance, mm; negative inside the obstacle
inline double distance_mm(const Obstacle& obstacle, const Eigen::Vector3d& point_mm) {
  return distance_mm(obstacle, point_mm, point_mm);
}

}  // namespace bevel::controller
