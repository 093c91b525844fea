// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Exponential, logarithm, right Jacobian and adjoint of SO(3) and SE(3). Twists are (v | omega) = (translation,
/// rotation), as in (10) of the needle model.
/// Source: Barfoot, State Estimation for Robotics (2017), chapter 7 (Q of the Jacobian: 7.86b). The right Jacobian is
/// the left Jacobian of the negative argument.
#include <Eigen/Core>
#include <Eigen/Geometry>

/// Needle models: extended bicycle model, effects, open-loop prediction and a mechanical plant.
namespace bevel::model {

/// Twist or body perturbation (v | omega), mm | rad.
using Vector6d = Eigen::Matrix<double, 6, 1>;
/// Linear map between twists, in the order (v | omega).
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Pose of frame {B} in frame {A}. A point x_B has the coordinates p_mm + R x_B in {A}.
struct Pose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< orientation of {B} in {A}, 3 x 3, orthonormal
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();   ///< origin of {B} in {A}, mm

  /// Composes two poses.
  /// @param other pose of {C} in {B}
  /// @return the pose of {C} in {A}
  Pose operator*(const Pose& other) const { return {R * other.R, p_mm + R * other.p_mm}; }
  /// Inverts the pose.
  /// @return the pose of {A} in {B}
  Pose inverse() const { return {R.transpose(), -(R.transpose() * p_mm)}; }
};

/// Computes the skew-symmetric matrix of a vector.
/// @param v 3-vector, any unit
/// @return the 3 x 3 matrix with hat(v) x = v cross x, in the unit of \p v
Eigen::Matrix3d hat(const Eigen::Vector3d& v);
/// Computes the exponential of SO(3).
/// @param rotation_rad rotation vector, rad
/// @return the rotation matrix, 3 x 3
Eigen::Matrix3d exp_so3(const Eigen::Vector3d& rotation_rad);
/// Computes the logarithm of SO(3).
/// @param R rotation matrix, 3 x 3
/// @return the rotation vector, rad, with a norm of at most pi
Eigen::Vector3d log_so3(const Eigen::Matrix3d& R);
/// Computes the right Jacobian J of SO(3): exp(r + dr) = exp(r) exp(J dr) to first order.
/// @param rotation_rad rotation vector r, rad
/// @return J, 3 x 3
Eigen::Matrix3d right_jacobian_so3(const Eigen::Vector3d& rotation_rad);

/// Computes the exponential of SE(3).
/// @param twist (v | omega), mm | rad
/// @return the pose
Pose exp_se3(const Vector6d& twist);
/// Computes the logarithm of SE(3).
/// @param pose pose
/// @return the twist (v | omega), mm | rad, with |omega| at most pi
Vector6d log_se3(const Pose& pose);
/// Computes the right Jacobian J of SE(3): exp(x + dx) = exp(x) exp(J dx) to first order (Barfoot, 7.86b).
/// @param twist x = (v | omega), mm | rad
/// @return J, 6 x 6
Matrix6d right_jacobian_se3(const Vector6d& twist);

/// Computes the adjoint Ad of a pose: pose exp(x) pose^-1 = exp(Ad x).
/// @param pose pose
/// @return Ad, 6 x 6
Matrix6d adjoint(const Pose& pose);

/// Orthonormalises a rotation matrix by one Newton step of the polar decomposition. The result is the nearest
/// orthonormal matrix to first order. Applied after each product it keeps 10^6 products on SO(3).
/// @param R nearly orthonormal matrix, 3 x 3
/// @return the orthonormalised matrix, 3 x 3
Eigen::Matrix3d orthonormalised(const Eigen::Matrix3d& R);

}  // namespace bevel::model
