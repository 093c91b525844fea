// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Steering by arcs: the bevel angle is constant, and changes only when the predicted miss leaves the range that can
/// still be corrected.
///
/// With a constant bevel angle the inputs are constant, and the predicted point where the tip passes the target's depth
/// does not depend on the time of the prediction (to 3 % with slip, whose direction the tilt of the shaft changes). Let
/// W be the vector from that point for a spinning needle, which has no net bend, to the target. Let reach >= 0 be the
/// distance by which the point moves to the bevel's side if the bevel angle is kept. Both are at the target's depth.
/// The predicted miss is the vector
///
///     m = W - reach u,    u the unit vector toward the bevel's side.
///
/// Insertion leaves m unchanged (tested on random poses and needles); rotation changes it by -reach du. Hence
///
///     facing  (u along W):    |m| = | |W| - reach |: overshoot if reach > |W|, out of reach if reach < |W|;
///     away    (u against W):  inserting ds increases |W| - reach by 2 d(reach)/ds ds.
///
/// The sliding variable is S = |W| - reach. The law keeps S in the tube [-width, 0]:
///
/// - If S < -width, the bevel rotates away from W, and S increases by at least 2 d(reach)/ds per mm for every W. The
///   tube is reached after an insertion of at most (-S) / (2 d(reach)/ds).
/// - Once S >= -width / 2, including the insertion during the rotation, the bevel rotates toward W and stops. The
///   remaining angle to W is kept within the tube as well.
/// - If S > 0 (out of reach), the bevel faces W, which gives the smallest miss.
///
/// The width is the range that can still be corrected, a share of the remaining bend. It is at least the change by the
/// shortest correction, two half turns at the limits of rate and acceleration, since an attempt to correct less
/// increases the miss. It is at least the uncertainty of the reach: an overshoot can be corrected later, a lack of
/// reach cannot.
#include <Eigen/Core>
#include <optional>

#include <bevel/controller/steering_law.hpp>

namespace bevel::controller {

/// Position of the target relative to the arcs that the needle can make.
struct ArcGeometry {
  bool in_domain = false;  ///< false: a pose is outside the model's domain, and the geometry is not valid
  double ahead_mm = 0;     ///< distance to the target's depth along the shaft, mm; not positive: the target is passed
  Eigen::Vector2d aim_mm = Eigen::Vector2d::Zero();   ///< W, in the frame of the shaft, mm
  double reach_mm = 0;                                ///< reach on the side of the target, mm
  double reach_sd_mm = 0;                             ///< standard deviation of the reach by BendUncertainty, mm
  double reach_per_mm = 0;                            ///< decrease of the reach with insertion, mm per mm
  double facing_rad = 0;                              ///< rotation of the bevel that faces W, in (-pi, pi]
  Eigen::Vector2d miss_mm = Eigen::Vector2d::Zero();  ///< m, in the frame of the shaft, mm
};

/// Standard deviations of the estimated bend.
struct BendUncertainty {
  double curvature_per_mm = 0,  ///< of k, 1/mm
      bending_mm = 0;           ///< of the bending length, mm
};

/// Computes the geometry of the arcs to a target.
/// @param tip pose of the shaft's end in {A}, mm
/// @param needle parameters of the needle
/// @param shaft bending length and guide distance of a stiff shaft
/// @param target_mm target in {A}, mm
/// @param uncertain standard deviations of the bend
/// @return geometry; `in_domain` is false outside the slip law's domain and beyond the steps of ArcWalk::to_plane. For
/// a
///     target behind the tip, all except `ahead_mm` is zero.
ArcGeometry arc_geometry(const model::Pose& tip, const model::NeedleParameters& needle, const ShaftConfig& shaft,
                         const Eigen::Vector3d& target_mm, const BendUncertainty& uncertain = {});

/// Computes the predicted miss under continued steering: the part of W beyond the reach, for any law that may rotate
/// during insertion.
/// @param geometry geometry of the arcs to the target
/// @param by_half_turns steering by half turns only (Law::flip in tissue), which cannot reduce the part of W
///     perpendicular to the plane of the bevel
/// @return distance in the plane through the target perpendicular to the shaft, mm; infinity for a target behind the
/// tip
///     and outside the model's domain
double arc_miss_mm(const ArcGeometry& geometry, bool by_half_turns = false);
/// Insertion up to which Law::flip may rotate the needle by any angle, mm: the needle is not in the tissue.
inline constexpr double kOutside_mm = 1;

/// Law by arcs (Law::arcs) and by half turns (Law::flip), with the state of the rotation in progress.
class ArcLaw {
 public:
  /// Discards the state, for a new insertion.
  void restart() { *this = {}; }
  /// Computes the rates of the law without acceleration limits.
  /// @param geometry geometry of the arcs to the target
  /// @param rotation_rad position of the rotation axis, rad; for the limit of the cable
  /// @param inserted_mm position of the insertion axis, mm; up to kOutside_mm any rotation is allowed
  /// @param tolerance_mm tolerated predicted miss, mm; added to the width of the tube
  /// @param config law, limits and gains
  /// @return rates, mm/s and rad/s; zero outside the model's domain and for a target behind the tip
  Rates step(const ArcGeometry& geometry, double rotation_rad, double inserted_mm, double tolerance_mm,
             const ControllerConfig& config);

 private:
  enum class Side { undecided, facing, away };
  Rates flip(double error_rad, double rotation_rad, double inserted_mm, const ControllerConfig& config);

  Side side_ = Side::undecided;
  bool turning_ = false;
  std::optional<double> flip_to_rad_;  // position of the axis at the end of the present half turn
  double flipped_at_mm_ = 0;           // insertion at the end of the previous half turn
  double turn_ = 1;                    // direction of rotation if both are equally long
};

}  // namespace bevel::controller
