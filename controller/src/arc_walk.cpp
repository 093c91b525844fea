// SPDX-License-Identifier: MIT
#include <bevel/controller/arc_walk.hpp>

#include <algorithm>

#include <bevel/model/shaft_end.hpp>

namespace bevel::controller {
namespace {
// Of a slack shaft, whose arc is even: its landing 80 mm on is off by 2e-4 mm at most.
constexpr double kSlackStep_mm = 10.0;
constexpr int kMostSteps = 100;
}  // namespace

ArcWalk::End ArcWalk::end_at(double depth_mm) const {
  const double k = needle_.curvature_per_mm, b = shaft_.bending_mm;
  if (!(b > 0)) return {k, 0, 0};
  const model::ShaftEnd end = model::shaft_end((depth_mm + shaft_.guide_mm) / b);
  return {k * end.g * end.h, k * b * end.h, 0.5 * k * b * b * end.g};
}

model::Pose ArcWalk::middle_of(const model::Pose& tip) const {
  const End now = end_at(tip.p_mm.z());
  model::Pose middle = tip;
  middle.R = tip.R * model::exp_so3({-0.5 * now.cut_rad, 0, 0});
  middle.p_mm += middle.R.col(1) * now.swing_mm;
  return middle;
}

model::Pose ArcWalk::tip_of(const model::Pose& middle) const {
  const double cut_rad = end_at(middle.p_mm.z()).cut_rad;
  return {middle.R * model::exp_so3({0.5 * cut_rad, 0, 0}), tip_mm(middle, 1)};
}

Eigen::Vector3d ArcWalk::tip_mm(const model::Pose& middle, double share) const {
  return middle.p_mm - middle.R.col(1) * (share * end_at(middle.p_mm.z()).swing_mm);
}

bool ArcWalk::step(model::Pose& middle, double share, double step_mm) const {
  const End end = end_at(middle.p_mm.z() + 0.5 * step_mm);
  middle.p_mm -= middle.R.col(1) * (share * end.cut_rad * step_mm);
  return model::step(middle, {step_mm, 0, {share * end.curvature_per_mm, 0}}, slip_);
}

double ArcWalk::step_to_plane_mm(const model::Pose& middle, const Eigen::Vector3d& point_mm,
                                 const Eigen::Vector3d& along, double longest_mm) {
  const double ahead_mm = along.dot(point_mm - middle.p_mm);
  if (ahead_mm <= 1e-3) return 0;
  return std::min(longest_mm, ahead_mm / std::max(0.2, along.dot(middle.R.col(2))));
}

bool ArcWalk::to_plane(model::Pose middle, const Eigen::Vector3d& point_mm, const Eigen::Vector3d& along, double share,
                       Eigen::Vector3d& at_mm) const {
  const double longest_mm = shaft_.bending_mm > 0 ? kDrawnStep_mm : kSlackStep_mm;
  for (int i = 0; i < kMostSteps; ++i) {
    const double step_mm = step_to_plane_mm(middle, point_mm, along, longest_mm);
    if (step_mm <= 0) {
      at_mm = tip_mm(middle, share);
      return true;
    }
    if (!step(middle, share, step_mm)) return false;
  }
  return false;
}

}  // namespace bevel::controller
