// SPDX-License-Identifier: MIT
#pragma once
// Sliding-mode steering of the bevel toward a target (Rucker et al., IEEE T-RO 2013, PMC4231884).
//
// The target in the tip frame is q = R^T (t - p). The needle does not move along its heading but along (f, 1), so the
// lateral direction that matters is a = q_xy - f q_z: where the target lies beside the line of motion at its own depth.
// Sliding variable: sigma = atan2(a_x, -a_y) for k > 0 (bevel side -e2), both signs turned for k < 0: the angle from
// the bevel side to the target's side, in (-pi, pi].
//
// Sign: turning the shaft by dphi (right hand, about e3) turns the frame under the target, so d sigma = -dphi, and
//     u2 = +(D + eta) sat(sigma / Phi).
// (Published summaries of the law carry a minus with sigma counted the other way round; tests/controller shows it.)
//
// Reaching condition. Insertion makes sigma drift: with body twist u1 (f_x, f_y, 1 | w_x, w_y, 0) the lateral vector
// moves by |da/dt| <= u1 (|w| q_z + |df/ds| q_z) =: u1 d, the part across a turns sigma by at most u1 d / |a|. With
// D >= u1 d / |a| for every k and f within the declared uncertainty,
//     d/dt sigma^2 / 2 = sigma (-u2 + drift) <= -|sigma| (D + eta - D) = -eta |sigma|      outside |sigma| < Phi,
// so sigma reaches the boundary layer in finite time and stays. D grows as |a| -> 0: where the rate limit is below D,
// or inside the tolerance, the condition cannot hold and need not: the predicted miss is then already |a|.
#include <bevel/controller/config.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::controller {

struct SteeringGeometry {
  double ahead_mm = 0;                               // q_z: distance to go along the heading
  Eigen::Vector2d aim_mm = Eigen::Vector2d::Zero();  // a
  double sigma_rad = 0;                              // sliding variable
  double drift_bound_rad_s = 0;                      // D at the given insertion rate
  bool in_domain = false;                            // false: the pose has left the model's domain; the rest is zero
};

// target_mm in {A}. With a stiff shaft the tip moves toward the bevel of the shaft's end by half the angle at which it
// cuts (estimator/src/stiff_shaft.cpp). The drift bound is for `insertion_rate_mm_s` and parameters wrong by
// `parameter_uncertainty`.
SteeringGeometry steering_geometry(const model::Pose& tip, const model::NeedleParameters& needle,
                                   const Eigen::Vector3d& target_mm, double insertion_rate_mm_s,
                                   double parameter_uncertainty, const ShaftConfig& shaft = {});

struct Rates {
  double insertion_mm_s = 0;
  double rotation_rad_s = 0;
};

// The law without ramps: what it would command at this instant. `rotation_rad` is the axis' position, for the cable.
Rates steering_rates(const SteeringGeometry& geometry, double rotation_rad, double tolerance_mm,
                     const ControllerConfig& config);

// Moves `rates` toward `wanted` by at most the accelerations times dt.
Rates ramp(const Rates& rates, const Rates& wanted, double dt_s, const SteeringLimits& limits);

}  // namespace bevel::controller
