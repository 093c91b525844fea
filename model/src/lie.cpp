// SPDX-License-Identifier: MIT
#include <bevel/model/lie.hpp>

#include <cmath>

#include <bevel/model/angle_functions.hpp>

namespace bevel::model {
namespace {

Eigen::Matrix3d left_jacobian_so3(const Eigen::Matrix3d& W, const Eigen::Matrix3d& W2, const AngleFunctions& f) {
  return Eigen::Matrix3d::Identity() + f.b * W + f.c * W2;
}

}  // namespace

Eigen::Matrix3d hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d exp_so3(const Eigen::Vector3d& rotation_rad) {
  const AngleFunctions f = angle_functions(rotation_rad.squaredNorm());
  const Eigen::Matrix3d W = hat(rotation_rad);
  return Eigen::Matrix3d::Identity() + f.a * W + f.b * W * W;
}

Eigen::Vector3d log_so3(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d right_jacobian_so3(const Eigen::Vector3d& rotation_rad) {
  const AngleFunctions f = angle_functions(rotation_rad.squaredNorm());
  const Eigen::Matrix3d W = hat(rotation_rad);
  return Eigen::Matrix3d::Identity() - f.b * W + f.c * W * W;
}

Pose exp_se3(const Vector6d& twist) {
  const Eigen::Vector3d omega = twist.tail<3>();
  const AngleFunctions f = angle_functions(omega.squaredNorm());
  const Eigen::Matrix3d W = hat(omega);
  const Eigen::Matrix3d W2 = W * W;
  return {Eigen::Matrix3d::Identity() + f.a * W + f.b * W2, left_jacobian_so3(W, W2, f) * twist.head<3>()};
}

Vector6d log_se3(const Pose& pose) {
  Vector6d twist;
  const Eigen::Vector3d omega = log_so3(pose.R);
  const Eigen::Matrix3d W = hat(omega);
  const AngleFunctions f = angle_functions(omega.squaredNorm());
  twist << left_jacobian_so3(W, W * W, f).inverse() * pose.p_mm, omega;
  return twist;
}

Matrix6d right_jacobian_se3(const Vector6d& twist) {
  const Eigen::Vector3d v = -twist.head<3>();
  const Eigen::Vector3d w = -twist.tail<3>();
  const double t2 = w.squaredNorm();
  const AngleFunctions f = angle_functions(t2);
  const Eigen::Matrix3d W = hat(w);
  const Eigen::Matrix3d J = left_jacobian_so3(W, W * W, f);
  Matrix6d result;
  result.topLeftCorner<3, 3>() = J;
  result.bottomRightCorner<3, 3>() = J;
  result.bottomLeftCorner<3, 3>().setZero();
  // (7.86b) with its products of hats written out: W V = v w^T - (w.v) I, W V W = -(w.v) W, and
  // W W V + V W W = -|w|^2 V - (w.v) W.
  const double wv = w.dot(v);
  const Eigen::Matrix3d vw = v * w.transpose();
  Eigen::Matrix3d Q = (0.5 - f.d * t2) * hat(v) + (2 * f.d - f.c) * wv * W + f.c * (vw + vw.transpose()) -
                      2 * f.e * wv * w * w.transpose();
  Q.diagonal().array() += 2 * wv * (f.e * t2 - f.c);
  result.topRightCorner<3, 3>() = Q;
  return result;
}

Matrix6d adjoint(const Pose& pose) {
  Matrix6d result;
  result.topLeftCorner<3, 3>() = pose.R;
  result.bottomRightCorner<3, 3>() = pose.R;
  result.topRightCorner<3, 3>() = hat(pose.p_mm) * pose.R;
  result.bottomLeftCorner<3, 3>().setZero();
  return result;
}

Eigen::Matrix3d orthonormalised(const Eigen::Matrix3d& R) {
  // One Newton step of the polar decomposition: quadratic, and exact to rounding for the drift of a single product.
  return 0.5 * R * (3 * Eigen::Matrix3d::Identity() - R.transpose() * R);
}

}  // namespace bevel::model
