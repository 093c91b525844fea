// SPDX-License-Identifier: MIT
#pragma once
// The extended bicycle model in SE(3): its body twist, and one integration step with analytic Jacobians.
//
// Frames: {A} fixed, origin at the entry point, z_A into the tissue. {B} rides on the tip (the bicycle's back wheel),
// e3 of {B} is the heading. Right-hand rule: omega_x = +k turns the heading toward -y, so a needle that bends toward
// -y has k > 0 here and tan(beta) < 0 in the planar form (5), (13).
//
// Twist per unit of insertion, isotropic slip: V1 = (f_x, f_y, 1 | kappa_x - f_y/ell, kappa_y + f_x/ell, 0), with
// f = tan(alpha) d along the tilt d of the heading away from z_A; per unit of rotation: V2 = (0 0 0 | 0 0 1), (10).
// The curvature kappa is a vector in {B}; the needle's own is (k, 0). What is left out of the model so often is
// another curvature, insertion or rotation than the nominal one that these three are inputs of a step.
#include <bevel/model/lie.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::model {

// Increments of one step, at constant rates within it.
struct StepInput {
  double insertion_mm = 0;
  double rotation_rad = 0;
  Eigen::Vector2d curvature_per_mm = Eigen::Vector2d::Zero();  // kappa in {B}; (k, 0) for the plain needle
};

// The slip law as the integrator uses it: everything of NeedleParameters but the curvature.
struct SlipParameters {
  double lambda1_per_rad = 0;
  double lambda2 = 0;
  double wheelbase_mm = 20;
  SlipDirection direction = SlipDirection::isotropic;
  FrontWheel front_wheel = FrontWheel::published;
};
SlipParameters slip_parameters(const NeedleParameters& needle);

// Derivatives of the pose after a step, as body-frame perturbations: pose_after exp(delta), delta = (mm | rad).
struct StepJacobian {
  Matrix6d pose;                      // by the perturbation of the pose before (same form)
  Eigen::Matrix<double, 6, 4> input;  // by insertion (1/mm), rotation (1/rad), kappa_x, kappa_y (1 per 1/mm)
  Eigen::Matrix<double, 6, 3> slip;   // by lambda1, lambda2, wheelbase
};

// The same without the increments: what a filter of the needle's parameters needs, at less than half the cost.
struct NeedleJacobian {
  Matrix6d pose;
  Eigen::Matrix<double, 6, 4> needle;  // by kappa_x, lambda1, lambda2, wheelbase
};

// Body twist for one step (increments, not rates). False outside the domain of (25); `twist` is then not written.
bool body_twist(const Eigen::Matrix3d& R, const StepInput& input, const SlipParameters& slip, Vector6d& twist);

// One step of the fourth-order commutator-free Lie-group method (Celledoni, Marthinsen and Owren 2003, Future
// Generation Computer Systems 19, eq. 13): for a constant twist, the bicycle, it is the exact exponential whatever
// the step. False outside the domain of (25); `pose` is then unchanged. Does not allocate.
bool step(Pose& pose, const StepInput& input, const SlipParameters& slip);
bool step(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian);

// The same over increments of any size, cut into steps of at most 2.5 mm and 0.25 rad, or one step of the midpoint
// rule where the increment is less than 0.5 mm and 0.01 rad: finer steps move the tip by less than 1e-4 mm over 130 mm
// (tested).
bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip);
bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian);
bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian);

// The same pose, with derivatives of the midpoint rule: off by the square of the step (tested), some 1e-3 of what the
// step changes at 0.1 rad, for a covariance more than enough, at three quarters of the time.
bool advance_by_midpoint(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian);

// Angle between the heading and z_A, in [0, pi].
double tilt_rad(const Pose& pose);

}  // namespace bevel::model
