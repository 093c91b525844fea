// SPDX-License-Identifier: MIT
#pragma once
// Steps along an arc that the needle makes with the bevel kept, or turned all the time so that only a share of the bend
// is left. With a stiff shaft (bevel/model/shaft_end.hpp) turning swings the tip about the middle of a circle: the walk
// is that of the middle, which does not depend on how the bevel stands.
#include <bevel/controller/config.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::controller {

class ArcWalk {
 public:
  ArcWalk(const model::NeedleParameters& needle, const ShaftConfig& shaft)
      : needle_(needle), slip_(model::slip_parameters(needle)), shaft_(shaft) {}

  // Of a path that is looked at between its steps, and of a stiff shaft, which yields less near the entry.
  static constexpr double kDrawnStep_mm = 4.0;

  // The middle of the swing of a tip, both in {A}.
  model::Pose middle_of(const model::Pose& tip) const;
  model::Pose tip_of(const model::Pose& middle) const;  // the same back
  // Where the tip is, with this share of the bend.
  Eigen::Vector3d tip_mm(const model::Pose& middle, double share) const;

  // By step_mm of insertion; false outside the model's domain.
  bool step(model::Pose& middle, double share, double step_mm) const;
  /// Walks to the plane through \p point_mm perpendicular to \p along with this share of the bend.
  /// The number of steps is bounded: 100 of 10 mm, or of 4 mm with a stiff shaft, so that the cost is bounded too.
  /// @param at_mm tip on the plane, {A}, mm.
  /// @return false outside the model's domain and where the plane lies beyond these steps.
  bool to_plane(model::Pose middle, const Eigen::Vector3d& point_mm, const Eigen::Vector3d& along, double share,
                Eigen::Vector3d& at_mm) const;
  // What is to be inserted until the plane, but no more than a step; nothing where it is passed.
  static double step_to_plane_mm(const model::Pose& middle, const Eigen::Vector3d& point_mm,
                                 const Eigen::Vector3d& along, double longest_mm = kDrawnStep_mm);

  // What a stiff shaft does at a depth; of a slack one only the curvature, the needle's.
  struct End {
    double curvature_per_mm = 0, cut_rad = 0, swing_mm = 0;
  };
  End end_at(double depth_mm) const;

 private:
  model::NeedleParameters needle_;
  model::SlipParameters slip_;
  ShaftConfig shaft_;
};

}  // namespace bevel::controller
