// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Motion of a stiff shaft's end in addition to that of the bicycle model. stiff_shaft.cpp has the derivation.
#include <Eigen/Core>

#include <bevel/model/shaft_end.hpp>

namespace bevel::estimator {

/// Stiff shaft at one depth: a beam on an elastic foundation.
struct Shaft {
  double curvature_per_mm = 0;  ///< curvature of its path deep in the tissue, 1/mm
  double bending_mm = 0;        ///< bending length, mm
  double bending_lengths = 0;   ///< distance from the guide to the tip over the bending length
};

/// Motion of the shaft's end in one step, in addition to the bicycle model, with its derivatives.
struct EndMotion {
  Eigen::Vector3d moved_mm;      ///< displacement in {B} before the step, mm
  Eigen::Vector3d by_curvature,  ///< derivative of the displacement by Shaft::curvature_per_mm, mm per 1/mm
      by_bending;                ///< derivative of the displacement by Shaft::bending_mm, mm per mm
  double share = 1;              ///< share of the curvature that bends the path, g h
  double share_by_bending = 0;   ///< derivative of the share by Shaft::bending_mm, 1/mm
};
/// Computes the motion of the shaft's end while it is inserted and rotated.
/// @param shaft shaft before the step
/// @param insertion_mm increment of the insertion, mm
/// @param rotation_rad increment of the rotation, rad
/// @return displacement in {B} before the step, with derivatives
EndMotion end_motion(const Shaft& shaft, double insertion_mm, double rotation_rad);

/// Displacement of the tip from the position under the force of the bevel to that without it: the centre of the circle
/// on which rotation moves the tip.
struct Swing {
  Eigen::Vector3d to_middle_mm,  ///< displacement in {B}, mm
      by_curvature,              ///< its derivative by Shaft::curvature_per_mm, mm per 1/mm
      by_bending;                ///< its derivative by Shaft::bending_mm, mm per mm
};
/// Computes the displacement of the tip by the force of the bevel.
/// @param shaft shaft at the present depth
/// @return displacement to the centre, {B}, mm, with derivatives
Swing swing_of(const Shaft& shaft);

}  // namespace bevel::estimator
