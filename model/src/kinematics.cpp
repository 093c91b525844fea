// SPDX-License-Identifier: MIT
#include <bevel/model/kinematics.hpp>

#include <algorithm>
#include <cmath>

#include "stages.hpp"

namespace bevel::model {
namespace {

using namespace stages;

constexpr double kMaxStep_mm = 2.5;
constexpr double kMaxStep_rad = 0.25;
// A short step takes the midpoint rule: where the body turns by h rad, that leaves h^2 f/12 of the step out, 2e-6.
constexpr double kShortTurn_rad = 0.01;
constexpr double kSharpest_per_mm = 0.02;  // what turns a needle as it goes on, its slip included

// The derivative by the pose before, of a step that moves it by `moved`: a rotation of the body about a and b is in two
// of the columns.
template <int kColumns>
BEVEL_IN_PLACE void set_by_pose(StepDerivative<kColumns>& derivative, const Pose& moved, const Vector3d& a,
                                const Vector3d& b) {
  const Matrix3d back = moved.R.transpose();
  derivative.pose.template topLeftCorner<3, 3>() = back;
  derivative.pose.template bottomLeftCorner<3, 3>().setZero();
  derivative.pose.template rightCols<3>() = derivative.columns.col(kTilt).lazyProduct(a.transpose());
  derivative.pose.template rightCols<3>() += derivative.columns.col(kAcross).lazyProduct(b.transpose());
  derivative.pose.template topRightCorner<3, 3>() -= back * hat(moved.p_mm);
  derivative.pose.template bottomRightCorner<3, 3>() += back;
}

// kExact: of the step as it is taken. kMidpoint: of the midpoint rule, near the same path; off by the square of the
// step.
enum class Derivatives { kExact, kMidpoint };

template <int kColumns, Derivatives kRule = Derivatives::kExact>
bool step_impl(Pose& pose, const StepInput& input, const SlipParameters& slip, StepDerivative<kColumns>* derivative) {
  const Stepper stepper(input, slip);
  const auto turn = [&stepper](const Vector2d& f) { return Vector3d(stepper.twist(f).template tail<3>()); };
  const auto half = [&stepper](const Vector2d& f) { return Vector6d(0.5 * stepper.twist(2 * f)); };

  const Axis axis1(pose.R.row(2).transpose());
  const Slip law1 = evaluate_slip(std::atan2(axis1.q, axis1.n.z()), slip.lambda1_per_rad, slip.lambda2);
  if (!law1.in_domain) return false;
  const SlipNear law(law1, slip.lambda1_per_rad, slip.lambda2);
  const Vector2d f1 = lateral(axis1, law1, slip);
  const Vector3d c2 = 0.5 * turn(f1);
  const Axis axis2(turned(axis1.n, c2));
  const Slip law2 = slip_near(axis2, axis1, law);
  if (!law2.in_domain) return false;
  const Vector2d f2 = lateral(axis2, law2, slip);
  const Vector3d c3 = 0.5 * turn(f2);
  const Axis axis3(turned(axis1.n, c3));
  const Slip law3 = slip_near(axis3, axis1, law);
  if (!law3.in_domain) return false;
  const Vector2d f3 = lateral(axis3, law3, slip);
  const Vector3d c4 = turn(f3) - c2;
  const Axis axis4(turned(axis2.n, c4));
  const Slip law4 = slip_near(axis4, axis1, law);
  if (!law4.in_domain) return false;
  const Vector2d f4 = lateral(axis4, law4, slip);
  // Two half steps, with the weights of either: the twist is linear in f but for what does not change within a step.
  const Vector2d fA = (3 * f1 + 2 * f2 + 2 * f3 - f4) / 12;
  const Vector2d fB = (-f1 + 2 * f2 + 2 * f3 + 3 * f4) / 12;
  if constexpr (kColumns == kNone) {
    pose = pose * exponential(half(fA)) * exponential(half(fB));
    return true;
  } else {
    const double ds = input.insertion_mm;
    // A body rotation delta moves n by n x delta: along b for one about a, along -a for one about b.
    const Vector3d a(-axis1.e.y(), axis1.e.x(), 0);
    const Vector3d b = axis1.n.cross(a);
    Rows<3, kColumns> Dn1 = Rows<3, kColumns>::Zero();
    Dn1.col(kTilt) = b;
    Dn1.col(kAcross) = -a;
    const Rows<2, kColumns> D1 = lateral_by_columns<kColumns>(axis1, law1, Dn1, slip);
    const Rows<2, kColumns> Dc2 = 0.5 * stepper.turn_by_columns<kColumns>(f1, D1, 1);
    const Rows<3, kColumns> Dn2 = turned_by_columns<kColumns>(axis2.n, c2, Dn1, Dc2, 0.5);
    const Rows<2, kColumns> D2 = lateral_by_columns<kColumns>(axis2, law2, Dn2, slip);
    auto& columns = derivative->columns;
    Pose total;
    if constexpr (kRule == Derivatives::kMidpoint) {
      const ExpWithJacobian whole(stepper.twist(fA + fB));
      Rows<4, kColumns> D;
      D.template topRows<2>() = ds * D2;
      D.template bottomRows<2>() = stepper.turn_by_columns<kColumns>(fA + fB, D2, 1);
      columns.template topRows<3>().noalias() = whole.J.leftCols<2>().lazyProduct(D.template topRows<2>());
      columns.template topRows<3>().noalias() += whole.Q.leftCols<2>().lazyProduct(D.template bottomRows<2>());
      columns.template bottomRows<3>().noalias() = whole.J.leftCols<2>().lazyProduct(D.template bottomRows<2>());
      total = exponential(half(fA)) * exponential(half(fB));
    } else {
      const Rows<2, kColumns> Dc3 = 0.5 * stepper.turn_by_columns<kColumns>(f2, D2, 1);
      const Rows<3, kColumns> Dn3 = turned_by_columns<kColumns>(axis3.n, c3, Dn1, Dc3, 0.5);
      const Rows<2, kColumns> D3 = lateral_by_columns<kColumns>(axis3, law3, Dn3, slip);
      const Rows<2, kColumns> Dc4 = stepper.turn_by_columns<kColumns>(f3, D3, 1) - Dc2;
      const Rows<3, kColumns> Dn4 = turned_by_columns<kColumns>(axis4.n, c4, Dn2, Dc4, 0.5);
      const Rows<2, kColumns> D4 = lateral_by_columns<kColumns>(axis4, law4, Dn4, slip);
      const ExpWithJacobian A(half(fA)), B(half(fB));
      const Rows<2, kColumns> DfA = (3 * D1 + 2 * D2 + 2 * D3 - D4) / 12;
      const Rows<2, kColumns> DfB = (-D1 + 2 * D2 + 2 * D3 + 3 * D4) / 12;
      // pose exp(A) exp(B): what A does is seen through Ad(exp(-B)).
      const Matrix3d Bt = B.pose.R.transpose();
      const Matrix3d KA = Bt * A.J;
      const Matrix3d LA = Bt * (A.Q - hat(B.pose.p_mm) * A.J);
      // Velocities v = (v_x, v_y) and rates of turn w = (w_x, w_y) of both halves, stacked.
      Rows<8, kColumns> D;
      D.template middleRows<2>(0) = ds * DfA;
      D.template middleRows<2>(2) = stepper.turn_by_columns<kColumns>(fA, DfA, 0.5);
      D.template middleRows<2>(4) = ds * DfB;
      D.template middleRows<2>(6) = stepper.turn_by_columns<kColumns>(fB, DfB, 0.5);
      if constexpr (kColumns == kAll) {
        D.template block<2, 1>(0, kInsertion) += fA;
        D.template block<2, 1>(4, kInsertion) += fB;
      }
      Eigen::Matrix<double, 3, 8> top;
      top << KA.leftCols<2>(), LA.leftCols<2>(), B.J.leftCols<2>(), B.Q.leftCols<2>();
      columns.template topRows<3>().noalias() = top.lazyProduct(D);
      columns.template bottomRows<3>().noalias() = KA.leftCols<2>().lazyProduct(D.template middleRows<2>(2));
      columns.template bottomRows<3>().noalias() += B.J.leftCols<2>().lazyProduct(D.template middleRows<2>(6));
      if constexpr (kColumns == kAll) {
        columns.template block<3, 1>(0, kInsertion) += 0.5 * (KA.col(2) + B.J.col(2));
        columns.template block<3, 1>(0, kRotation) += 0.5 * (LA.col(2) + B.Q.col(2));
        columns.template block<3, 1>(3, kRotation) += 0.5 * (KA.col(2) + B.J.col(2));
      }
      total = A.pose * B.pose;
    }
    set_by_pose(*derivative, total, a, b);
    pose = pose * total;
    return true;
  }
}

// One step of the midpoint rule, with its own derivatives.
template <int kColumns>
bool short_step_impl(Pose& pose, const StepInput& input, const SlipParameters& slip,
                     StepDerivative<kColumns>* derivative) {
  const Stepper stepper(input, slip);
  const Axis axis1(pose.R.row(2).transpose());
  const Slip law1 = evaluate_slip(std::atan2(axis1.q, axis1.n.z()), slip.lambda1_per_rad, slip.lambda2);
  if (!law1.in_domain) return false;
  const Vector2d f1 = lateral(axis1, law1, slip);
  const Vector3d c2 = 0.5 * stepper.twist(f1).template tail<3>();
  const Axis axis2(turned(axis1.n, c2));
  const Slip law2 = slip_near(axis2, axis1, SlipNear(law1, slip.lambda1_per_rad, slip.lambda2));
  if (!law2.in_domain) return false;
  const Vector2d f2 = lateral(axis2, law2, slip);
  if constexpr (kColumns == kNone) {
    pose = pose * exponential(stepper.twist(f2));
  } else {
    // As in step_impl().
    const Vector3d a(-axis1.e.y(), axis1.e.x(), 0);
    const Vector3d b = axis1.n.cross(a);
    Rows<3, kColumns> Dn1 = Rows<3, kColumns>::Zero();
    Dn1.col(kTilt) = b;
    Dn1.col(kAcross) = -a;
    const Rows<2, kColumns> D1 = lateral_by_columns<kColumns>(axis1, law1, Dn1, slip);
    const Rows<2, kColumns> Dc2 = 0.5 * stepper.turn_by_columns<kColumns>(f1, D1, 1);
    const Rows<3, kColumns> Dn2 = turned_by_columns<kColumns>(axis2.n, c2, Dn1, Dc2, 0.5);
    const Rows<2, kColumns> D2 = lateral_by_columns<kColumns>(axis2, law2, Dn2, slip);
    const ExpWithJacobian whole(stepper.twist(f2));
    Rows<4, kColumns> D;
    D.template topRows<2>() = input.insertion_mm * D2;
    D.template bottomRows<2>() = stepper.turn_by_columns<kColumns>(f2, D2, 1);
    if constexpr (kColumns == kAll) D.template block<2, 1>(0, kInsertion) += f2;
    auto& columns = derivative->columns;
    columns.template topRows<3>().noalias() = whole.J.leftCols<2>().lazyProduct(D.template topRows<2>());
    columns.template topRows<3>().noalias() += whole.Q.leftCols<2>().lazyProduct(D.template bottomRows<2>());
    columns.template bottomRows<3>().noalias() = whole.J.leftCols<2>().lazyProduct(D.template bottomRows<2>());
    if constexpr (kColumns == kAll) {
      columns.template block<3, 1>(0, kInsertion) += whole.J.col(2);
      columns.template block<3, 1>(0, kRotation) += whole.Q.col(2);
      columns.template block<3, 1>(3, kRotation) += whole.J.col(2);
    }
    set_by_pose(*derivative, whole.pose, a, b);
    pose = pose * whole.pose;
  }
  return true;
}

// By the motion alone: a path is a smooth function of the needle.
bool is_short(const StepInput& input) {
  return std::abs(input.rotation_rad) + kSharpest_per_mm * std::abs(input.insertion_mm) < kShortTurn_rad;
}

int substeps(const StepInput& input) {
  const double count =
      std::max(std::abs(input.insertion_mm) / kMaxStep_mm, std::abs(input.rotation_rad) / kMaxStep_rad);
  return std::clamp(static_cast<int>(std::ceil(count)), 1, 1 << 20);
}

// Cuts an increment into steps and chains their derivatives.
template <int kColumns, Derivatives kRule = Derivatives::kExact>
bool advance_impl(Pose& pose, const StepInput& input, const SlipParameters& slip,
                  StepDerivative<kColumns>* derivative) {
  if constexpr (kColumns == kNone)
    if (input.insertion_mm == 0 && input.rotation_rad == 0) return true;  // at rest
  if (is_short(input)) return short_step_impl<kColumns>(pose, input, slip, derivative);
  const int count = substeps(input);
  if (count == 1) return step_impl<kColumns, kRule>(pose, input, slip, derivative);
  const StepInput part{input.insertion_mm / count, input.rotation_rad / count, input.curvature_per_mm};
  Pose trial = pose;
  StepDerivative<kColumns> last;
  for (int i = 0; i < count; ++i) {
    if (!step_impl<kColumns, kRule>(trial, part, slip, &last)) return false;
    if constexpr (kColumns != kNone) {
      // The increments of a part are 1/count of the whole's.
      if constexpr (kColumns == kAll) last.columns.template middleCols<2>(kInsertion) /= count;
      if (i == 0) {
        *derivative = last;
      } else {
        derivative->pose = last.pose * derivative->pose;
        derivative->columns = last.pose * derivative->columns + last.columns;
      }
    }
  }
  pose = trial;
  return true;
}

void unpack(const StepDerivative<kAll>& from, StepJacobian& to) {
  to.pose = from.pose;
  to.input << from.columns.col(kInsertion), from.columns.col(kRotation), from.columns.col(kKappaX),
      from.columns.col(kKappaY);
  to.slip = from.columns.middleCols<3>(kLambda1);
}

}  // namespace

SlipParameters slip_parameters(const NeedleParameters& needle) {
  return {needle.lambda1_per_rad, needle.lambda2, needle.wheelbase_mm, needle.slip, needle.front_wheel};
}

bool body_twist(const Matrix3d& R, const StepInput& input, const SlipParameters& slip, Vector6d& twist) {
  const Axis axis(R.row(2).transpose());
  const Slip law = evaluate_slip(std::atan2(axis.q, axis.n.z()), slip.lambda1_per_rad, slip.lambda2);
  if (!law.in_domain) return false;
  twist = Stepper(input, slip).twist(lateral(axis, law, slip));
  return true;
}

bool step(Pose& pose, const StepInput& input, const SlipParameters& slip) {
  return step_impl<kNone>(pose, input, slip, nullptr);
}

bool step(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian) {
  StepDerivative<kAll> derivative;
  if (!step_impl<kAll>(pose, input, slip, &derivative)) return false;
  unpack(derivative, jacobian);
  return true;
}

bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip) {
  return advance_impl<kNone>(pose, input, slip, nullptr);
}

bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, StepJacobian& jacobian) {
  StepDerivative<kAll> derivative;
  if (!advance_impl<kAll>(pose, input, slip, &derivative)) return false;
  unpack(derivative, jacobian);
  return true;
}

namespace {

template <Derivatives kRule>
bool advance_needle(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian) {
  StepDerivative<kNeedle> derivative;
  if (!advance_impl<kNeedle, kRule>(pose, input, slip, &derivative)) return false;
  jacobian.pose = derivative.pose;
  jacobian.needle = derivative.columns.middleCols<4>(kKappaX);
  return true;
}

}  // namespace

bool advance(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian) {
  return advance_needle<Derivatives::kExact>(pose, input, slip, jacobian);
}

bool advance_by_midpoint(Pose& pose, const StepInput& input, const SlipParameters& slip, NeedleJacobian& jacobian) {
  return advance_needle<Derivatives::kMidpoint>(pose, input, slip, jacobian);
}

double tilt_rad(const Pose& pose) { return std::atan2(pose.R.row(2).head<2>().norm(), pose.R(2, 2)); }

}  // namespace bevel::model
