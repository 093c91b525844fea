// SPDX-License-Identifier: MIT
#pragma once
// SE(3) and SO(3): exponential, right Jacobian, adjoint. Twists are (v | omega) = (translation, rotation), as in (10).
// Source: Barfoot, State Estimation for Robotics (2017), chapter 7 (Q of the Jacobian: 7.86b); right Jacobian = left
// Jacobian of the negative.
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace bevel::model {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Pose of frame {B} in frame {A}: a point x_B is p_mm + R x_B in {A}.
struct Pose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();

  Pose operator*(const Pose& other) const { return {R * other.R, p_mm + R * other.p_mm}; }
  Pose inverse() const { return {R.transpose(), -(R.transpose() * p_mm)}; }
};

Eigen::Matrix3d hat(const Eigen::Vector3d& v);
Eigen::Matrix3d exp_so3(const Eigen::Vector3d& rotation_rad);
Eigen::Vector3d log_so3(const Eigen::Matrix3d& R);
Eigen::Matrix3d right_jacobian_so3(const Eigen::Vector3d& rotation_rad);

Pose exp_se3(const Vector6d& twist);
Vector6d log_se3(const Pose& pose);
Matrix6d right_jacobian_se3(const Vector6d& twist);

// Ad of a pose: pose exp(x) pose^-1 = exp(Ad x).
Matrix6d adjoint(const Pose& pose);

// The rotation's nearest orthonormal matrix to first order: keeps 10^6 products on SO(3).
Eigen::Matrix3d orthonormalised(const Eigen::Matrix3d& R);

}  // namespace bevel::model
