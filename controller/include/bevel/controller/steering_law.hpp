// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Sliding-mode steering of the bevel toward a target (Rucker et al., IEEE T-RO 2013, PMC4231884).
///
/// The target in the tip frame is q = R^T (t - p). The needle moves along (f, 1) and not along its heading, so the
/// relevant lateral vector is a = q_xy - f q_z, from the line of motion to the target at the target's depth. The
/// sliding variable is sigma = atan2(a_x, -a_y) for k > 0 (bevel side -e2), with both signs reversed for k < 0. It is
/// the angle from the bevel side to the target's side, in (-pi, pi].
///
/// Sign: a rotation of the shaft by dphi (right-hand rule, about e3) rotates the frame and not the target, so
/// d sigma = -dphi, and
///
///     u2 = +(D + eta) sat(sigma / Phi).
///
/// Published summaries of the law have a minus sign with the opposite sign of sigma (tests/controller has the check).
///
/// Reaching condition: insertion makes sigma drift. With the body twist u1 (f_x, f_y, 1 | w_x, w_y, 0) the lateral
/// vector moves by |da/dt| <= u1 (|w| q_z + |df/ds| q_z) =: u1 d, whose part perpendicular to a changes sigma by at
/// most u1 d / |a|. With D >= u1 d / |a| for every k and f within the declared uncertainty,
///
///     d/dt sigma^2 / 2 = sigma (-u2 + drift) <= -|sigma| (D + eta - D) = -eta |sigma|      outside |sigma| < Phi,
///
/// so sigma reaches the boundary layer in finite time and stays there. D grows as |a| -> 0. If the rate limit is below
/// D, or within the tolerance, the condition does not hold; it is not needed, since the predicted miss is already |a|.
#include <bevel/controller/config.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::controller {

/// Position of the target relative to the motion of the tip.
struct SteeringGeometry {
  double ahead_mm = 0;                               ///< q_z, distance to the target along the heading, mm
  Eigen::Vector2d aim_mm = Eigen::Vector2d::Zero();  ///< a, in the frame of the tip, mm
  double sigma_rad = 0;                              ///< sigma, the sliding variable, rad, in (-pi, pi]
  double drift_bound_rad_s = 0;                      ///< D at the given insertion rate, rad/s
  bool in_domain = false;  ///< false: the pose is outside the model's domain; the rest is zero
};

/// Computes the sliding variable and the bound of its drift.
///
/// The tip of a stiff shaft moves at an angle to the shaft's end, toward the bevel: half the angle at which it cuts
/// (estimator/src/stiff_shaft.cpp).
/// @param tip pose of the shaft's end in {A}, mm
/// @param needle parameters of the needle
/// @param target_mm target in {A}, mm
/// @param insertion_rate_mm_s insertion rate for the drift bound, mm/s
/// @param parameter_uncertainty relative error of k and f that the drift bound covers
/// @param shaft bending length and guide distance of a stiff shaft
/// @return geometry; `in_domain` is false outside the domain of the slip law (25)
SteeringGeometry steering_geometry(const model::Pose& tip, const model::NeedleParameters& needle,
                                   const Eigen::Vector3d& target_mm, double insertion_rate_mm_s,
                                   double parameter_uncertainty, const ShaftConfig& shaft = {});

/// Rates of the two axes.
struct Rates {
  double insertion_mm_s = 0;  ///< insertion, mm/s; negative for a retraction
  double rotation_rad_s = 0;  ///< rotation, rad/s
};

/// Computes the rates of the law without acceleration limits.
/// @param geometry position of the target
/// @param rotation_rad position of the rotation axis, rad; for the limit of the cable
/// @param tolerance_mm length of a below which the bevel does not rotate, mm
/// @param config limits and gains
/// @return rates, mm/s and rad/s; zero outside the model's domain and for a target behind the tip
Rates steering_rates(const SteeringGeometry& geometry, double rotation_rad, double tolerance_mm,
                     const ControllerConfig& config);

/// Moves rates toward wanted rates within the limits of acceleration.
/// @param rates present rates
/// @param wanted rates to approach
/// @param dt_s time step, s
/// @param limits limits of acceleration
/// @return rates after the step, mm/s and rad/s
Rates ramp(const Rates& rates, const Rates& wanted, double dt_s, const SteeringLimits& limits);

}  // namespace bevel::controller
