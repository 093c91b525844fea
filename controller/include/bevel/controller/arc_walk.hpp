// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Prediction of the arc that the needle makes during insertion.
#include <bevel/controller/config.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::controller {

/// Predicts the path of a needle with constant bevel angle, or with a rotation that leaves only a share of the bend.
///
/// Rotation of a stiff shaft (bevel/model/shaft_end.hpp) moves the tip on a circle. The prediction propagates the
/// centre of that circle, here called the middle, which does not depend on the bevel angle. Without a stiff shaft the
/// middle is the tip.
class ArcWalk {
 public:
  /// Constructs the prediction for a needle.
  /// @param needle parameters of the needle; copied
  /// @param shaft bending length and guide distance of a stiff shaft; copied
  ArcWalk(const model::NeedleParameters& needle, const ShaftConfig& shaft)
      : needle_(needle), slip_(model::slip_parameters(needle)), shaft_(shaft) {}

  /// Step of a path that is evaluated between its ends, and of a stiff shaft, whose compliance depends on depth; mm.
  static constexpr double kDrawnStep_mm = 4.0;

  /// Computes the middle of a tip.
  /// @param tip pose of the shaft's end in {A}, mm
  /// @return pose of the middle in {A}, mm
  model::Pose middle_of(const model::Pose& tip) const;
  /// Computes the tip of a middle; the inverse of middle_of().
  /// @param middle pose of the middle in {A}, mm
  /// @return pose of the shaft's end in {A}, mm
  model::Pose tip_of(const model::Pose& middle) const;
  /// Computes the position of the tip with a share of the bend.
  /// @param middle pose of the middle in {A}, mm
  /// @param share share of the bend, in [0, 1]
  /// @return position in {A}, mm
  Eigen::Vector3d tip_mm(const model::Pose& middle, double share) const;

  /// Moves the middle by one step of insertion.
  /// @param middle pose of the middle in {A}, mm, before and after the step
  /// @param share share of the bend, in [0, 1]
  /// @param step_mm insertion, mm
  /// @return false outside the domain of the slip law (25)
  bool step(model::Pose& middle, double share, double step_mm) const;
  /// Predicts where the tip passes a plane. At most 100 steps of 10 mm, or of 4 mm with a stiff shaft, bound the cost.
  /// @param middle pose of the middle in {A}, mm
  /// @param point_mm point of the plane, {A}, mm
  /// @param along normal of the plane, unit vector in {A}
  /// @param share share of the bend, in [0, 1]
  /// @param[out] at_mm tip on the plane, {A}, mm; only written if the result is true
  /// @return false outside the model's domain and if the plane lies beyond these steps
  bool to_plane(model::Pose middle, const Eigen::Vector3d& point_mm, const Eigen::Vector3d& along, double share,
                Eigen::Vector3d& at_mm) const;
  /// Computes the next step toward a plane.
  /// @param middle pose of the middle in {A}, mm
  /// @param point_mm point of the plane, {A}, mm
  /// @param along normal of the plane, unit vector in {A}
  /// @param longest_mm largest step, mm
  /// @return insertion, mm; 0 at or beyond the plane
  static double step_to_plane_mm(const model::Pose& middle, const Eigen::Vector3d& point_mm,
                                 const Eigen::Vector3d& along, double longest_mm = kDrawnStep_mm);

  /// Bend of the shaft's end at one depth.
  struct End {
    double curvature_per_mm = 0,  ///< curvature of the path, 1/mm; k if the shaft is not stiff
        cut_rad = 0,              ///< angle toward the bevel at which a stiff shaft cuts, rad
        swing_mm = 0;             ///< distance from the middle to the tip, mm
  };
  /// Computes the bend of the shaft's end.
  /// @param depth_mm depth of the tip, z in {A}, mm
  /// @return curvature, angle and distance at that depth
  End end_at(double depth_mm) const;

 private:
  model::NeedleParameters needle_;
  model::SlipParameters slip_;
  ShaftConfig shaft_;
};

}  // namespace bevel::controller
