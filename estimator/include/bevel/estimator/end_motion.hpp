// SPDX-License-Identifier: MIT
#pragma once
// The motions of a stiff shaft's end beside the bicycle's (stiff_shaft.cpp, where they are derived). mm, rad, in {B}.
#include <Eigen/Core>

#include <bevel/model/shaft_end.hpp>

namespace bevel::estimator {

struct Shaft {
  double curvature_per_mm = 0;  // of the path it cuts, deep in the tissue
  double bending_mm = 0;
  double bending_lengths = 0;  // from the guide to the tip
};

struct EndMotion {
  Eigen::Vector3d moved_mm;  // in {B} before the step
  Eigen::Vector3d by_curvature, by_bending;
  double share = 1;             // of k that bends the path
  double share_by_bending = 0;  // 1/mm
};
// While it is fed and turned.
EndMotion end_motion(const Shaft& shaft, double insertion_mm, double rotation_rad);

// From a tip that the bevel pushes aside to where it is without that force, the middle of the circle on which turning
// swings it.
struct Swing {
  Eigen::Vector3d to_middle_mm, by_curvature, by_bending;
};
Swing swing_of(const Shaft& shaft);

}  // namespace bevel::estimator
