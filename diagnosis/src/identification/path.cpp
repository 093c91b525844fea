// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/path.hpp>

namespace bevel::diagnosis {
namespace {

using Eigen::Vector3d;
using BodyColumns = Eigen::Matrix<double, 6, kPathColumns>;  // d(body perturbation of the pose)/d(parameters)

model::Pose entry_pose(const Entry& entry, BodyColumns& D) {
  // Tilt as one rotation vector in the xy plane, then roll about the shaft.
  const Vector3d tilt(entry(kEntryTiltX), entry(kEntryTiltY), 0);
  const Eigen::Matrix3d unroll = model::exp_so3({0, 0, -entry(kEntryRoll)});
  model::Pose pose;
  pose.R = model::exp_so3(tilt) * unroll.transpose();
  pose.p_mm = {entry(kEntryOffsetX), entry(kEntryOffsetY), 0};
  D.setZero();
  D.block<3, 2>(3, entry_column(kEntryTiltX)) = unroll * model::right_jacobian_so3(tilt).leftCols<2>();
  D(5, entry_column(kEntryRoll)) = 1;
  D.block<3, 2>(0, entry_column(kEntryOffsetX)) = pose.R.transpose().leftCols<2>();
  return pose;
}

void add_step(const model::StepJacobian& J, BodyColumns& D) {
  D = (J.pose * D).eval();
  D.col(kNeedleCurvature) += J.input.col(2);
  D.middleCols<3>(kNeedleLambda1) += J.slip;
}

// Weights of the cubic on [0, 1] for both ends' values and slopes.
struct Cubic {
  double p0, v0, p1, v1;
};
Cubic cubic(double t) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, -2 * t3 + 3 * t2, t3 - t2};
}

// Slopes of the Jacobian along the insertion, from the neighbouring nodes: a Jacobian may err a little, it steers the
// fit and does not end it. The first leg holds the jump of a late entry (and is straight for it), and a leg without
// insertion has no slope: there the side that has one counts.
void find_slopes(const std::vector<Leg>& legs, std::vector<Path::Node>& nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double before_mm = i > 1 ? legs[i - 1].insertion_mm : 0;
    const double after_mm = i < legs.size() ? legs[i].insertion_mm : 0;
    auto& slope = nodes[i].slope_per_mm;
    slope.setZero();
    const bool both = before_mm * after_mm > 0;
    if (before_mm != 0)
      slope = (both ? after_mm / (before_mm + after_mm) : 1) * (nodes[i].jacobian - nodes[i - 1].jacobian) / before_mm;
    if (after_mm != 0 && (both || before_mm == 0))
      slope += (both ? before_mm / (before_mm + after_mm) : 1) * (nodes[i + 1].jacobian - nodes[i].jacobian) / after_mm;
  }
}

}  // namespace

bool integrate(const Insertion& insertion, const model::NeedleParameters& needle, const Entry& entry,
               bool with_jacobian, Path& path) {
  const model::SlipParameters slip = model::slip_parameters(needle);
  const Eigen::Vector2d curvature(needle.curvature_per_mm, 0);
  auto& nodes = path.nodes;
  nodes.resize(insertion.legs.size() + 1);
  BodyColumns D;
  nodes[0].pose = entry_pose(entry, D);
  if (with_jacobian) nodes[0].jacobian = nodes[0].pose.R * D.topRows<3>();
  double late_mm = entry(kLateEntry);

  model::Vector6d twist;
  model::StepJacobian J;
  for (std::size_t i = 0; i < insertion.legs.size(); ++i) {
    const Leg& leg = insertion.legs[i];
    model::StepInput input{leg.insertion_mm, leg.rotation_rad, curvature};
    // A late entry takes its length off the first leg that inserts.
    const bool first_inserting = late_mm != 0 && leg.insertion_mm != 0;
    const bool late_column = leg.insertion_mm != 0 && D.col(entry_column(kLateEntry)).isZero(0);
    if (first_inserting) {
      input.insertion_mm -= late_mm;
      late_mm = 0;
    }
    model::Pose pose = nodes[i].pose;
    if (!model::body_twist(pose.R, input, slip, twist)) return false;
    nodes[i].velocity_mm = pose.R * twist.head<3>();
    if (with_jacobian) {
      if (!model::step(pose, input, slip, J)) return false;
      add_step(J, D);
      if (late_column) D.col(entry_column(kLateEntry)) -= J.input.col(0);
      nodes[i + 1].jacobian = pose.R * D.topRows<3>();
    } else if (!model::step(pose, input, slip)) {
      return false;
    }
    if (!model::body_twist(pose.R, input, slip, twist)) return false;
    nodes[i + 1].arrival_mm = pose.R * twist.head<3>();
    nodes[i + 1].pose = pose;
  }

  if (with_jacobian) find_slopes(insertion.legs, nodes);
  path.position_mm.resize(insertion.observations.size());
  if (with_jacobian) path.jacobian.resize(insertion.observations.size());
  for (std::size_t i = 0; i < insertion.observations.size(); ++i) {
    const Observation& seen = insertion.observations[i];
    const auto& a = nodes[seen.leg];
    const auto& b = nodes[seen.leg + 1];
    const Cubic c = cubic(seen.fraction);
    path.position_mm[i] = c.p0 * a.pose.p_mm + c.v0 * a.velocity_mm + c.p1 * b.pose.p_mm + c.v1 * b.arrival_mm;
    if (with_jacobian) {
      if (seen.leg == 0)
        path.jacobian[i] = (1 - seen.fraction) * a.jacobian + seen.fraction * b.jacobian;
      else
        path.jacobian[i] = c.p0 * a.jacobian + c.p1 * b.jacobian +
                           insertion.legs[seen.leg].insertion_mm * (c.v0 * a.slope_per_mm + c.v1 * b.slope_per_mm);
    }
  }
  return true;
}

std::vector<Vector3d> straight_insertion(const model::NeedleParameters& needle, double length_mm, double spacing_mm) {
  std::vector<Vector3d> points{Vector3d::Zero()};
  model::Pose pose;
  const model::StepInput input{spacing_mm, 0, {needle.curvature_per_mm, 0}};
  const auto steps = static_cast<int>((length_mm + 1e-9) / spacing_mm);
  for (int i = 0; i < steps; ++i) {
    if (!model::step(pose, input, model::slip_parameters(needle))) break;
    points.push_back(pose.p_mm);
  }
  return points;
}

}  // namespace bevel::diagnosis
