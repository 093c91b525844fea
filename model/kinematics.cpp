#include "model/kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "model/slip.hpp"

namespace bevel::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxStep_mm = 2.5;
constexpr double kMaxStep_rad = 0.25;

// Columns of a stage's Jacobian: initial body rotation (3), insertion, rotation, kappa_x, kappa_y, lambda1, lambda2,
// ell.
constexpr int kColumns = 10;
using Row2 = Eigen::Matrix<double, 2, kColumns>;
using Row3 = Eigen::Matrix<double, 3, kColumns>;
using Row6 = Eigen::Matrix<double, 6, kColumns>;
enum Column { kInsertion = 3, kRotation, kKappaX, kKappaY, kLambda1, kLambda2, kWheelbase };

double front_wheel_sign(const SlipParameters& slip) { return slip.front_wheel == FrontWheel::published ? 1.0 : -1.0; }

// f as a vector in the body's xy plane, and its derivatives, for the insertion axis n = R^T z_A seen in the body.
struct SlipVector {
  Vector2d f;
  Eigen::Matrix<double, 2, 3> by_axis;  // by n, along the sphere |n| = 1
  Vector2d by_lambda1, by_lambda2;
};

template <bool kWithJacobian>
bool slip_vector(const Vector3d& n, const SlipParameters& slip, SlipVector& out) {
  const double q = n.head<2>().norm();
  const Slip law = evaluate_slip(std::atan2(q, n.z()), slip.lambda1_per_rad, slip.lambda2);
  if (!law.in_domain) return false;
  // Along z_A the direction of the tilt is undefined and f is zero: any unit vector serves, f/q tends to df/dtheta.
  const bool tilted = q > 1e-12;
  const Vector2d e = tilted ? Vector2d(n.head<2>() / q) : Vector2d(1, 0);
  out.f = -law.f * e;
  if constexpr (kWithJacobian) {
    const double radial = law.f_by_tilt_per_rad * n.z();
    const double across = tilted ? law.f / q : law.f_by_tilt_per_rad;
    out.by_axis.leftCols<2>() = -(radial - across) * e * e.transpose() - across * Eigen::Matrix2d::Identity();
    out.by_axis.col(2) = law.f_by_tilt_per_rad * q * e;
    out.by_lambda1 = -law.f_by_lambda1_rad * e;
    out.by_lambda2 = -law.f_by_lambda2 * e;
  }
  if (slip.direction == SlipDirection::bevel_plane) {
    out.f.x() = 0;
    if constexpr (kWithJacobian) {
      out.by_axis.row(0).setZero();
      out.by_lambda1.x() = 0;
      out.by_lambda2.x() = 0;
    }
  }
  return true;
}

// One stage: the twist F at the insertion axis n, and its Jacobian given that of the stage's body rotation.
template <bool kWithJacobian>
bool evaluate_stage(const Vector3d& n, const Row3& rotation, const StepInput& input, const SlipParameters& slip,
                    Vector6d& F, Row6& DF) {
  SlipVector s;
  if (!slip_vector<kWithJacobian>(n, slip, s)) return false;
  const double ds = input.insertion_mm;
  const double turn_per_mm = front_wheel_sign(slip) / slip.wheelbase_mm;
  const double omega_x = input.curvature_per_mm.x() - turn_per_mm * s.f.y();
  const double omega_y = input.curvature_per_mm.y() + turn_per_mm * s.f.x();
  F << ds * s.f.x(), ds * s.f.y(), ds, ds * omega_x, ds * omega_y, input.rotation_rad;
  if constexpr (kWithJacobian) {
    // n = R^T z_A moves by n x delta under a body rotation delta.
    Row2 Df = (s.by_axis * hat(n)) * rotation;
    Df.col(kLambda1) += s.by_lambda1;
    Df.col(kLambda2) += s.by_lambda2;
    DF.row(0) = ds * Df.row(0);
    DF.row(1) = ds * Df.row(1);
    DF.row(2).setZero();
    DF.row(3) = -turn_per_mm * ds * Df.row(1);
    DF.row(4) = turn_per_mm * ds * Df.row(0);
    DF.row(5).setZero();
    DF.col(kInsertion) += (Vector6d() << s.f, 1, omega_x, omega_y, 0).finished();
    DF(5, kRotation) += 1;
    DF(3, kKappaX) += ds;
    DF(4, kKappaY) += ds;
    DF(3, kWheelbase) += turn_per_mm / slip.wheelbase_mm * ds * s.f.y();
    DF(4, kWheelbase) -= turn_per_mm / slip.wheelbase_mm * ds * s.f.x();
  }
  return true;
}

template <bool kWithJacobian>
bool step_impl(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian* jacobian) {
  const Vector3d n1 = pose.R.row(2).transpose();
  Vector6d F1, F2, F3, F4;
  Row3 D1, D2, D3, D4;
  Row6 DF1, DF2, DF3, DF4;
  if constexpr (kWithJacobian) {
    D1.setZero();
    D1.leftCols<3>().setIdentity();
  }
  // A stage's rotation is the base's times exp(c): its perturbation is exp(-c) D_base + J_r(c) dc.
  const auto turn = [](const Vector3d& c, const Row3& D_base, const Row3& Dc, Row3& D_out) -> Matrix3d {
    Matrix3d back = exp_so3(-c);
    if constexpr (kWithJacobian) D_out = back * D_base + right_jacobian_so3(c) * Dc;
    return back;
  };

  if (!evaluate_stage<kWithJacobian>(n1, D1, input, slip, F1, DF1)) return false;
  const Vector3d n2 = turn(0.5 * F1.tail<3>(), D1, 0.5 * DF1.bottomRows<3>(), D2) * n1;
  if (!evaluate_stage<kWithJacobian>(n2, D2, input, slip, F2, DF2)) return false;
  const Vector3d n3 = turn(0.5 * F2.tail<3>(), D1, 0.5 * DF2.bottomRows<3>(), D3) * n1;
  if (!evaluate_stage<kWithJacobian>(n3, D3, input, slip, F3, DF3)) return false;
  const Vector3d n4 =
      turn(F3.tail<3>() - 0.5 * F1.tail<3>(), D2, DF3.bottomRows<3>() - 0.5 * DF1.bottomRows<3>(), D4) * n2;
  if (!evaluate_stage<kWithJacobian>(n4, D4, input, slip, F4, DF4)) return false;

  const Vector6d A = (3 * F1 + 2 * F2 + 2 * F3 - F4) / 12;
  const Vector6d B = (-F1 + 2 * F2 + 2 * F3 + 3 * F4) / 12;
  const Pose exp_A = exp_se3(A);
  const Pose exp_B = exp_se3(B);
  if constexpr (kWithJacobian) {
    const Row6 DA = (3 * DF1 + 2 * DF2 + 2 * DF3 - DF4) / 12;
    const Row6 DB = (-DF1 + 2 * DF2 + 2 * DF3 + 3 * DF4) / 12;
    const Matrix6d back_A = adjoint(exp_A.inverse());
    const Matrix6d back_B = adjoint(exp_B.inverse());
    Row6 total = right_jacobian_se3(A) * DA;
    total.leftCols<3>() += back_A.rightCols<3>();
    total = (back_B * total).eval();
    total += right_jacobian_se3(B) * DB;
    jacobian->pose.leftCols<3>() = back_B * back_A.leftCols<3>();
    jacobian->pose.rightCols<3>() = total.leftCols<3>();
    jacobian->input = total.middleCols<4>(kInsertion);
    jacobian->slip = total.middleCols<3>(kLambda1);
  }
  pose = pose * exp_A * exp_B;
  return true;
}

int substeps(const StepInput& input) {
  const double count =
      std::max(std::abs(input.insertion_mm) / kMaxStep_mm, std::abs(input.rotation_rad) / kMaxStep_rad);
  return std::clamp(static_cast<int>(std::ceil(count)), 1, 1 << 20);
}

}  // namespace

SlipParameters slip_parameters(const NeedleParameters& needle) {
  return {needle.lambda1_per_rad, needle.lambda2, needle.wheelbase_mm, needle.slip, needle.front_wheel};
}

bool body_twist(const Matrix3d& R, const StepInput& input, const SlipParameters& slip, Vector6d& twist) {
  Row6 unused;
  return evaluate_stage<false>(R.row(2).transpose(), {}, input, slip, twist, unused);
}

bool step(Pose& pose, const StepInput& input, const SlipParameters& slip) {
  return step_impl<false>(pose, input, slip, nullptr);
}

bool step(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian) {
  return step_impl<true>(pose, input, slip, &jacobian);
}

bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip) {
  const int count = substeps(input);
  if (count == 1) return step(pose, input, slip);
  const StepInput part{input.insertion_mm / count, input.rotation_rad / count, input.curvature_per_mm};
  Pose trial = pose;
  for (int i = 0; i < count; ++i)
    if (!step(trial, part, slip)) return false;
  pose = trial;
  return true;
}

bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian) {
  const int count = substeps(input);
  if (count == 1) return step(pose, input, slip, jacobian);
  const StepInput part{input.insertion_mm / count, input.rotation_rad / count, input.curvature_per_mm};
  Pose trial = pose;
  StepJacobian last;
  jacobian.pose.setIdentity();
  jacobian.input.setZero();
  jacobian.slip.setZero();
  for (int i = 0; i < count; ++i) {
    if (!step(trial, part, slip, last)) return false;
    // The increments of a part are 1/count of the whole's.
    last.input.leftCols<2>() /= count;
    jacobian.pose = last.pose * jacobian.pose;
    jacobian.input = last.pose * jacobian.input + last.input;
    jacobian.slip = last.pose * jacobian.slip + last.slip;
  }
  pose = trial;
  return true;
}

double tilt_rad(const Pose& pose) { return std::atan2(pose.R.row(2).head<2>().norm(), pose.R(2, 2)); }

}  // namespace bevel::model
