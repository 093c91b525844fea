#include "model/lie.hpp"

#include <cmath>

namespace bevel::model {
namespace {

// The functions of the angle t that exp and the Jacobians are made of, all as functions of t^2.
struct AngleFunctions {
  double a;  // sin t / t
  double b;  // (1 - cos t) / t^2
  double c;  // (t - sin t) / t^3
  double d;  // (t^2/2 + cos t - 1) / t^4
  double e;  // (2 t - 3 sin t + t cos t) / (2 t^5)
};

AngleFunctions angle_functions(double t2) {
  if (t2 < 0.3) {
    // Series: the closed forms lose digits to cancellation here, and steps of a needle are small turns.
    const double x = t2;
    const auto series = [x](double c0, double c1, double c2, double c3, double c4, double c5, double c6) {
      return c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * (c5 + x * c6)))));
    };
    return {
        series(1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800, 1.0 / 6227020800),
        series(1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320, 1.0 / 3628800, -1.0 / 479001600, 1.0 / 87178291200),
        series(1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880, 1.0 / 39916800, -1.0 / 6227020800, 1.0 / 1307674368000),
        series(1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800, 1.0 / 479001600, -1.0 / 87178291200,
               1.0 / 20922789888000),
        series(1.0 / 120, -2.0 / 5040, 3.0 / 362880, -4.0 / 39916800, 5.0 / 6227020800, -6.0 / 1307674368000,
               7.0 / 355687428096000)};
  }
  const double t = std::sqrt(t2);
  const double s = std::sin(t);
  const double c = std::cos(t);
  return {s / t, (1 - c) / t2, (t - s) / (t2 * t), (t2 / 2 + c - 1) / (t2 * t2),
          (2 * t - 3 * s + t * c) / (2 * t2 * t2 * t)};
}

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
  const Eigen::Vector3d omega = -twist.tail<3>();
  const AngleFunctions f = angle_functions(omega.squaredNorm());
  const Eigen::Matrix3d W = hat(omega);
  const Eigen::Matrix3d V = hat(-twist.head<3>());
  const Eigen::Matrix3d W2 = W * W;
  const Eigen::Matrix3d WV = W * V;
  const Eigen::Matrix3d VW = V * W;
  const Eigen::Matrix3d WVW = WV * W;
  const Eigen::Matrix3d J = left_jacobian_so3(W, W2, f);
  Matrix6d result;
  result.topLeftCorner<3, 3>() = J;
  result.bottomRightCorner<3, 3>() = J;
  result.bottomLeftCorner<3, 3>().setZero();
  result.topRightCorner<3, 3>() =
      0.5 * V + f.c * (WV + VW + WVW) + f.d * (W * WV + VW * W - 3 * WVW) + f.e * (WVW * W + W * WVW);
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
