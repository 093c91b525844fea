// SPDX-License-Identifier: MIT
#pragma once
// Steering by arcs: the bevel rests, and is turned only when the predicted miss leaves what can still be corrected.
//
// With the bevel kept as it is, inputs are constant and the tip will pass the target's depth at a landing that does not
// depend on when it is predicted (to 3 % with slip, whose side the shaft's tilt turns). Let W be where the target lies
// beside the landing of a needle that spins (no net bend), and reach >= 0 by how much the landing lies to the bevel's
// side if the bevel is kept, both at the target's depth. The predicted miss is the vector
//     m = W - reach u,    u the unit vector toward the bevel's side.
// Insertion alone leaves m as it is (tested on drawn poses and needles); turning changes it by -reach du. So
//     facing  (u along W):    |m| = | |W| - reach |: overshoot where reach > |W|, out of reach where reach < |W|;
//     away    (u against W):  inserting ds makes |W| - reach grow by 2 d(reach)/ds ds.
// Sliding variable: S = |W| - reach. The law keeps S inside the tube [-width, 0]:
//     S < -width: the bevel turns away from W, and S rises at no less than 2 d(reach)/ds per mm, whatever W is: the
//     tube is reached after at most (-S) / (2 d(reach)/ds); once S >= -width / 2, counting what is inserted while it
//     turns, it turns to W and rests; the rest is the angle to W, kept within the tube as well.
// The width is what can still be corrected: a share of the bend to come, but no less than what the shortest correction,
// two half turns at the limits of rate and acceleration, would change (nothing smaller can be put right, and trying
// would make it worse), and no less than what the reach is uncertain by: too far can be mended later, too short cannot.
// Where S > 0 (out of reach) the bevel faces W: nothing comes nearer.
#include <Eigen/Core>
#include <optional>

#include <bevel/controller/steering_law.hpp>

namespace bevel::controller {

struct ArcGeometry {
  bool in_domain = false;                            // false: the pose has left the model's domain; the rest is zero
  double ahead_mm = 0;                               // to go until the target's depth, along the shaft
  Eigen::Vector2d aim_mm = Eigen::Vector2d::Zero();  // W, in the frame of the shaft
  double reach_mm = 0;
  double reach_sd_mm = 0;                             // by what is not known of k and the bending length
  double reach_per_mm = 0;                            // by which it falls with insertion
  double facing_rad = 0;                              // turn of the bevel that points it at W, in (-pi, pi]
  Eigen::Vector2d miss_mm = Eigen::Vector2d::Zero();  // m
};

// Standard deviations of the estimate.
struct BendUncertainty {
  double curvature_per_mm = 0, bending_mm = 0;
};

// tip: of the shaft's end, in {A}; target in {A}.
ArcGeometry arc_geometry(const model::Pose& tip, const model::NeedleParameters& needle, const ShaftConfig& shaft,
                         const Eigen::Vector3d& target_mm, const BendUncertainty& uncertain = {});

/// Returns the distance, mm, at which a needle that is steered on passes the target, in the plane through the target
/// perpendicular to the shaft: the part of W beyond the reach. Every law that may turn during insertion comes to this.
/// @param by_half_turns steered by half turns only (Law::flip in tissue): the part of W across the plane of the bevel
///     stays.
/// @return infinity for a target behind the tip and outside the model's domain.
double arc_miss_mm(const ArcGeometry& geometry, bool by_half_turns = false);
/// Insertion, mm, up to which the needle may be turned by any angle under Law::flip: it is not in the tissue yet.
inline constexpr double kOutside_mm = 1;

class ArcLaw {
 public:
  void restart() { *this = {}; }
  // What it would command now, without ramps. rotation_rad, inserted_mm: of the axes; for the cable, and since a needle
  // that is not in the tissue yet may be turned by any angle.
  Rates step(const ArcGeometry& geometry, double rotation_rad, double inserted_mm, double tolerance_mm,
             const ControllerConfig& config);

 private:
  enum class Side { undecided, facing, away };
  Rates flip(double error_rad, double rotation_rad, double inserted_mm, const ControllerConfig& config);

  Side side_ = Side::undecided;
  bool turning_ = false;
  std::optional<double> flip_to_rad_;  // of the axis, while a half turn is under way
  double flipped_at_mm_ = 0;           // of insertion
  double turn_ = 1;                    // the way round where both are as long
};

}  // namespace bevel::controller
