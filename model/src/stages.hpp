// SPDX-License-Identifier: MIT
#pragma once
// What the stages of a step are made of, for kinematics.cpp alone: the insertion axis seen in the body, the slip's
// lateral velocity there by (25), the twist that goes with it (kinematics.hpp), and their derivatives.
#include <cmath>

#include <bevel/model/angle_functions.hpp>
#include <bevel/model/kinematics.hpp>
#include <bevel/model/slip.hpp>

namespace bevel::model::stages {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Columns of a stage's Jacobian. Slip depends on the pose only through the insertion axis n seen in the body, a point
// of the unit sphere, so that two columns stand for the pose; kNeedle columns are all that a filter needs, kAll are
// all inputs of a step as well (and one more, which keeps rows even in length).
enum Column { kTilt, kAcross, kKappaX, kLambda1, kLambda2, kWheelbase, kInsertion, kRotation, kKappaY };
constexpr int kNone = 0;
constexpr int kNeedle = 6;
constexpr int kAll = 10;
template <int kColumns>
using Row = Eigen::Matrix<double, 1, kColumns, Eigen::RowMajor>;
template <int kRows, int kColumns>
using Rows = Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>;

inline double front_wheel_sign(const SlipParameters& slip) {
  return slip.front_wheel == FrontWheel::published ? 1.0 : -1.0;
}

// The insertion axis n = R^T z_A seen in the body, in polar form about the heading.
struct Axis {
  Vector3d n;
  double q;    // sine of the tilt
  Vector2d e;  // direction of n's part across the heading
  bool tilted;

  BEVEL_IN_PLACE explicit Axis(const Vector3d& axis) : n(axis), q(axis.head<2>().norm()), tilted(q > 1e-12) {
    // Along z_A the direction of the tilt is undefined and f is zero: any unit vector serves, f/q tends to df/dtheta.
    e = tilted ? Vector2d(n.head<2>() / q) : Vector2d(1, 0);
  }
};

// The slip law at an axis whose tilt is near that of another one: stages of a step lie within a degree of each other.
BEVEL_IN_PLACE Slip slip_near(const Axis& axis, const Axis& known, const SlipNear& law) {
  const double sine = axis.q * known.n.z() - axis.n.z() * known.q;
  if (axis.n.z() * known.n.z() + axis.q * known.q < 0) return law.at(std::atan2(axis.q, axis.n.z()));
  return law.at_change(sine);
}

// f as a vector in the body's xy plane.
BEVEL_IN_PLACE Vector2d lateral(const Axis& axis, const Slip& law, const SlipParameters& slip) {
  Vector2d f = -law.f * axis.e;
  if (slip.direction == SlipDirection::bevel_plane) f.x() = 0;
  return f;
}

// Its derivative by the columns; `Dn` is that of the axis.
template <int kColumns>
Rows<2, kColumns> lateral_by_columns(const Axis& axis, const Slip& law, const Rows<3, kColumns>& Dn,
                                     const SlipParameters& slip) {
  const Vector2d& e = axis.e;
  const double radial = law.f_by_tilt_per_rad * axis.n.z();
  const double across = axis.tilted ? law.f / axis.q : law.f_by_tilt_per_rad;
  Rows<2, 3> by_axis;  // along the sphere |n| = 1
  const double xy = (across - radial) * e.x() * e.y();
  const double z = law.f_by_tilt_per_rad * axis.q;
  by_axis << (across - radial) * e.x() * e.x() - across, xy, z * e.x(), xy, (across - radial) * e.y() * e.y() - across,
      z * e.y();
  Rows<2, kColumns> D = by_axis.lazyProduct(Dn);
  D.col(kLambda1) -= law.f_by_lambda1_rad * e;
  D.col(kLambda2) -= law.f_by_lambda2 * e;
  if (slip.direction == SlipDirection::bevel_plane) D.row(0).setZero();
  return D;
}

// The axis n after a rotation exp(c) of the body: exp(-c) n.
BEVEL_IN_PLACE Vector3d turned(const Vector3d& n, const Vector3d& c) {
  const AngleFunctions f = angle_functions(c.squaredNorm());
  const Vector3d cn = c.cross(n);
  return n - f.a * cn + f.b * c.cross(cn);
}

// Its derivative by the columns, exp(-c) Dn + n_after x (J_r(c) dc); Dc is that of c across the heading, `share` the
// weight of the stages that c is made of, for the rotation about the heading.
template <int kColumns>
Rows<3, kColumns> turned_by_columns(const Vector3d& after, const Vector3d& c, const Rows<3, kColumns>& Dn,
                                    const Rows<2, kColumns>& Dc, double share) {
  const AngleFunctions f = angle_functions(c.squaredNorm());
  const Matrix3d C = hat(c);
  const Matrix3d C2 = C * C;
  const Matrix3d back = Matrix3d::Identity() - f.a * C + f.b * C2;
  const Matrix3d J = Matrix3d::Identity() - f.b * C + f.c * C2;
  Matrix3d by_c;
  for (int i = 0; i < 3; ++i) by_c.col(i) = after.cross(J.col(i));
  Rows<3, kColumns> D = back.lazyProduct(Dn);
  D.noalias() += by_c.template leftCols<2>().lazyProduct(Dc);
  if constexpr (kColumns == kAll) D.col(kRotation) += share * by_c.col(2);
  return D;
}

// What all stages of one step share.
class Stepper {
 public:
  Stepper(const StepInput& input, const SlipParameters& slip)
      : input_(input), slip_(slip), ds_(input.insertion_mm), turn_per_mm_(front_wheel_sign(slip) / slip.wheelbase_mm) {}

  BEVEL_IN_PLACE Vector6d twist(const Vector2d& f) const {
    Vector6d F;
    F << ds_ * f.x(), ds_ * f.y(), ds_, ds_ * (input_.curvature_per_mm.x() - turn_per_mm_ * f.y()),
        ds_ * (input_.curvature_per_mm.y() + turn_per_mm_ * f.x()), input_.rotation_rad;
    return F;
  }

  // The derivative of the two rates of turn across the heading that f goes with; `share` is the sum of the weights of
  // the stages that f and Df are made of.
  template <int kColumns>
  Rows<2, kColumns> turn_by_columns(const Vector2d& f, const Rows<2, kColumns>& Df, double share) const {
    Rows<2, kColumns> D;
    D.row(0) = (-turn_per_mm_ * ds_) * Df.row(1);
    D.row(1) = (turn_per_mm_ * ds_) * Df.row(0);
    D(0, kKappaX) += share * ds_;
    D(0, kWheelbase) += turn_per_mm_ / slip_.wheelbase_mm * ds_ * f.y();
    D(1, kWheelbase) -= turn_per_mm_ / slip_.wheelbase_mm * ds_ * f.x();
    if constexpr (kColumns == kAll) {
      D(1, kKappaY) += share * ds_;
      D(0, kInsertion) += share * input_.curvature_per_mm.x() - turn_per_mm_ * f.y();
      D(1, kInsertion) += share * input_.curvature_per_mm.y() + turn_per_mm_ * f.x();
    }
    return D;
  }

 private:
  const StepInput& input_;
  const SlipParameters& slip_;
  double ds_;
  double turn_per_mm_;
};

// As exp_se3(), in place.
BEVEL_IN_PLACE Pose exponential(const Vector6d& twist) {
  const Vector3d v = twist.head<3>();
  const Vector3d w = twist.tail<3>();
  const double t2 = w.squaredNorm();
  const AngleFunctions f = angle_functions(t2);
  Pose pose;
  const double x = f.b * w.x(), y = f.b * w.y(), z = f.b * w.z();
  const double xy = x * w.y(), xz = x * w.z(), yz = y * w.z();
  const Vector3d a = f.a * w;
  pose.R << 1 - y * w.y() - z * w.z(), xy - a.z(), xz + a.y(), xy + a.z(), 1 - x * w.x() - z * w.z(), yz - a.x(),
      xz - a.y(), yz + a.x(), 1 - x * w.x() - y * w.y();
  const Vector3d wxv = w.cross(v);
  pose.p_mm = v + f.b * wxv + f.c * w.cross(wxv);
  return pose;
}

// Exponential of a twist and the blocks of its right Jacobian [J Q; 0 J], which share their functions.
struct ExpWithJacobian {
  Pose pose;
  Matrix3d J, Q;

  explicit ExpWithJacobian(const Vector6d& twist) {
    const Vector3d v = twist.head<3>();
    const Vector3d w = twist.tail<3>();
    const double t2 = w.squaredNorm();
    const AngleFunctions f = angle_functions(t2);
    const Matrix3d W = hat(w);
    Matrix3d ww = w * w.transpose();
    Matrix3d W2 = ww;
    W2.diagonal().array() -= t2;
    pose.R = Matrix3d::Identity() + f.a * W + f.b * W2;
    const Vector3d wxv = w.cross(v);
    pose.p_mm = v + f.b * wxv + f.c * w.cross(wxv);
    J = Matrix3d::Identity() - f.b * W + f.c * W2;
    // As right_jacobian_se3(), where its products of hats are explained.
    const double wv = w.dot(v);
    const Matrix3d vw = v * w.transpose();
    Q = hat((f.d * t2 - 0.5) * v - ((2 * f.d - f.c) * wv) * w) + f.c * (vw + vw.transpose()) - (2 * f.e * wv) * ww;
    Q.diagonal().array() += 2 * wv * (f.e * t2 - f.c);
  }
};

// Derivative of the pose after a step, by the pose before and by the columns.
template <int kColumns>
struct StepDerivative {
  Matrix6d pose;
  Rows<6, kColumns> columns;
};

}  // namespace bevel::model::stages
