#include "model/kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "model/angle_functions.hpp"
#include "model/slip.hpp"

namespace bevel::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxStep_mm = 2.5;
constexpr double kMaxStep_rad = 0.25;

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

double front_wheel_sign(const SlipParameters& slip) { return slip.front_wheel == FrontWheel::published ? 1.0 : -1.0; }

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
    const Matrix3d back = total.R.transpose();
    derivative->pose.template topLeftCorner<3, 3>() = back;
    derivative->pose.template bottomLeftCorner<3, 3>().setZero();
    derivative->pose.template rightCols<3>() = columns.col(kTilt).lazyProduct(a.transpose());
    derivative->pose.template rightCols<3>() += columns.col(kAcross).lazyProduct(b.transpose());
    derivative->pose.template topRightCorner<3, 3>() -= back * hat(total.p_mm);
    derivative->pose.template bottomRightCorner<3, 3>() += back;
    pose = pose * total;
    return true;
  }
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
