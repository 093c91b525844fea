// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Extended bicycle model in SE(3): body twist and integration step with analytic Jacobians.
///
/// Frames: {A} is fixed, with its origin at the entry point and z_A into the tissue. {B} moves with the tip (the back
/// wheel of the bicycle), and e3 of {B} is the heading. By the right-hand rule omega_x = +k turns the heading toward
/// -y. A needle that bends toward -y therefore has k > 0 here and tan(beta) < 0 in the planar form (5), (13).
///
/// Twist per unit of insertion, isotropic slip: V1 = (f_x, f_y, 1 | kappa_x - f_y/ell, kappa_y + f_x/ell, 0). Here
/// f = tan(alpha) d acts along the tilt d of the heading away from z_A. Twist per unit of rotation, (10):
/// V2 = (0 0 0 | 0 0 1).
/// The curvature kappa is a vector in {B}; the nominal value is (k, 0). Insertion, rotation and curvature are inputs of
/// a step, because most unmodelled effects change one of these three.
#include <bevel/model/lie.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::model {

/// Increments of one step. Their rates are constant within the step.
struct StepInput {
  double insertion_mm = 0;  ///< insertion along the heading, mm; negative retracts
  double rotation_rad = 0;  ///< rotation about the heading, rad, right-handed
  /// Curvature kappa in {B}, 1/mm, 2-vector; (k, 0) for the nominal model.
  Eigen::Vector2d curvature_per_mm = Eigen::Vector2d::Zero();
};

/// Parameters of the slip law in the integrator: NeedleParameters without the curvature.
struct SlipParameters {
  double lambda1_per_rad = 0;                          ///< lambda1 of (25), 1/rad
  double lambda2 = 0;                                  ///< lambda2 of (25), dimensionless
  double wheelbase_mm = 20;                            ///< ell, mm
  SlipDirection direction = SlipDirection::isotropic;  ///< direction of the slip when the shaft rotates
  FrontWheel front_wheel = FrontWheel::published;      ///< sign of f in (13)
};
/// Extracts the parameters of the slip law.
/// @param needle needle parameters
/// @return the same parameters without the curvature
SlipParameters slip_parameters(const NeedleParameters& needle);

/// Derivatives of the pose after a step. The perturbation delta = (mm | rad) acts in the body frame:
/// pose_after exp(delta).
struct StepJacobian {
  Matrix6d pose;                      ///< 6 x 6, with respect to the body perturbation of the pose before the step
  Eigen::Matrix<double, 6, 4> input;  ///< per mm of insertion, per rad of rotation, per 1/mm of kappa_x and kappa_y
  Eigen::Matrix<double, 6, 3> slip;   ///< per 1/rad of lambda1, per unit of lambda2, per mm of wheelbase
};

/// Derivatives of the pose after a step without those with respect to the increments. A filter of the needle parameters
/// needs only these, at less than half the cost of StepJacobian.
struct NeedleJacobian {
  Matrix6d pose;                       ///< 6 x 6, with respect to the body perturbation of the pose before the step
  Eigen::Matrix<double, 6, 4> needle;  ///< by kappa_x, lambda1, lambda2 and wheelbase, as in StepJacobian
};

/// Computes the body twist of one step, as increments and not as rates: u1 V1 + u2 V2 of (10), with slip.
/// @param R orientation of {B} in {A}, 3 x 3
/// @param input increments of the step
/// @param slip parameters of the slip law
/// @param[out] twist (v | omega) in {B}, mm | rad; not written on failure
/// @return false outside the domain of (25)
bool body_twist(const Eigen::Matrix3d& R, const StepInput& input, const SlipParameters& slip, Vector6d& twist);

/// Integrates one step by the fourth-order commutator-free Lie-group method. For a constant twist (the bicycle) the
/// result is the exact exponential for any step size. The function does not allocate.
/// Source: Celledoni, Marthinsen and Owren 2003, Future Generation Computer Systems 19, eq. 13.
/// @param[in,out] pose pose of {B} in {A}; unchanged on failure
/// @param input increments of the step
/// @param slip parameters of the slip law
/// @return false outside the domain of (25)
bool step(Pose& pose, const StepInput& input, const SlipParameters& slip);
/// Integrates one step and computes its exact derivatives.
/// @param[in,out] pose pose of {B} in {A}; unchanged on failure
/// @param input increments of the step
/// @param slip parameters of the slip law
/// @param[out] jacobian derivatives of the pose after the step; not written on failure
/// @return false outside the domain of (25)
bool step(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian);

/// Integrates increments of any size. Long increments are divided into steps of at most 2.5 mm and 0.25 rad. An
/// increment with |rotation| + 0.02 /mm |insertion| below 0.01 rad takes one step of the midpoint rule. Finer steps
/// move the tip by less than 1e-4 mm over 130 mm (tested).
/// @param[in,out] pose pose of {B} in {A}; unchanged on failure
/// @param input increments, constant rates
/// @param slip parameters of the slip law
/// @return false outside the domain of (25)
bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip);
/// Integrates increments of any size and computes all derivatives.
/// @param[in,out] pose pose of {B} in {A}; unchanged on failure
/// @param input increments, constant rates
/// @param slip parameters of the slip law
/// @param[out] jacobian derivatives of the pose after the increments; not written on failure
/// @return false outside the domain of (25)
bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian);
/// Integrates increments of any size and computes the derivatives with respect to the needle parameters.
/// @param[in,out] pose pose of {B} in {A}; unchanged on failure
/// @param input increments, constant rates
/// @param slip parameters of the slip law
/// @param[out] jacobian derivatives of the pose after the increments; not written on failure
/// @return false outside the domain of (25)
bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian);

/// Integrates increments as advance() does, with the derivatives of the midpoint rule. The pose is the same. The error
/// of the derivatives is quadratic in the step (tested): about 1e-3 of the change over a step of 0.1 rad, which is
/// sufficient for a covariance. The computation takes three quarters of the time.
/// @param[in,out] pose pose of {B} in {A}; unchanged on failure
/// @param input increments, constant rates
/// @param slip parameters of the slip law
/// @param[out] jacobian approximate derivatives of the pose after the increments; not written on failure
/// @return false outside the domain of (25)
bool advance_by_midpoint(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian);

/// Computes the tilt: the angle between the heading e3 of {B} and z_A.
/// @param pose pose of {B} in {A}
/// @return the tilt, rad, in [0, pi]
double tilt_rad(const Pose& pose);

}  // namespace bevel::model
