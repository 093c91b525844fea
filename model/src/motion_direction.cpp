// SPDX-License-Identifier: MIT
#include <bevel/model/motion_direction.hpp>

#include <cmath>

#include <bevel/model/slip.hpp>

namespace bevel::model {

bool motion_direction(const Eigen::Matrix3d& R, const SlipParameters& slip, MotionDirection& motion) {
  const Eigen::Vector3d n = R.row(2).transpose();  // z_A seen in the body
  const double q = n.head<2>().norm();             // sine of the tilt
  const Slip law = evaluate_slip(std::atan2(q, n.z()), slip.lambda1_per_rad, slip.lambda2);
  if (!law.in_domain) return false;
  // f = -tan(alpha) e along the tilt. Without a tilt it is zero, and any e serves: f / q tends to df/dtheta.
  const bool tilted = q > 1e-12;
  const Eigen::Vector2d e = tilted ? Eigen::Vector2d(n.head<2>() / q) : Eigen::Vector2d(1, 0);
  const double across = tilted ? law.f / q : law.f_by_tilt_per_rad;
  const Eigen::Matrix2d ee = e * e.transpose();
  Eigen::Matrix<double, 2, 3> f_by_n;
  f_by_n.leftCols<2>() = -(law.f_by_tilt_per_rad * n.z() * ee + across * (Eigen::Matrix2d::Identity() - ee));
  f_by_n.col(2) = law.f_by_tilt_per_rad * q * e;
  Eigen::Matrix2d f_by_slip;
  f_by_slip << -law.f_by_lambda1_rad * e, -law.f_by_lambda2 * e;
  Eigen::Vector2d f = -law.f * e;
  if (slip.direction == SlipDirection::bevel_plane) {
    f.x() = 0;
    f_by_n.row(0).setZero();
    f_by_slip.row(0).setZero();
  }
  const double length = std::sqrt(1 + f.squaredNorm());
  motion.along << f / length, 1 / length;
  const Eigen::Matrix<double, 3, 2> by_f =
      ((Eigen::Matrix3d::Identity() - motion.along * motion.along.transpose()) / length).leftCols<2>();
  // A body rotation omega moves n by n x omega, and carries the body's own direction with it.
  motion.by_turn = by_f * (f_by_n * hat(n)) - hat(motion.along);
  motion.by_slip = by_f * f_by_slip;
  return true;
}

}  // namespace bevel::model
