// SPDX-License-Identifier: MIT
#include "tests/effects/brute_force.hpp"

#include <Eigen/Geometry>

namespace bevel::model::testing {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// alpha(theta) from gamma = theta + alpha, alpha = lambda2 gamma - lambda1 gamma |gamma|, by bisection over gamma.
double slip_angle(double theta, const NeedleParameters& needle) {
  double low = 0;
  double high = 1.5;
  for (int i = 0; i < 45; ++i) {
    const double gamma = 0.5 * (low + high);
    const double alpha = needle.lambda2 * gamma - needle.lambda1_per_rad * gamma * gamma;
    (gamma - alpha < theta ? low : high) = gamma;
  }
  return 0.5 * (low + high) - theta;
}

// f along the tilt, or its part in the bevel plane.
Vector2d slip_of(const Matrix3d& R, const NeedleParameters& needle) {
  const Vector3d n = R.row(2).transpose();
  const double across = n.head<2>().norm();
  if (across < 1e-12 || (needle.lambda1_per_rad == 0 && needle.lambda2 == 0)) return Vector2d::Zero();
  // (25) is for a needle that bends toward -y: alpha has the sign of -(lambda1 gamma^2 - lambda2 |gamma|) there.
  Vector2d f = -std::tan(slip_angle(std::atan2(across, n.z()), needle)) * n.head<2>() / across;
  if (needle.slip == SlipDirection::bevel_plane) f.x() = 0;
  return f;
}

// One step: rates at its start, then at its middle.
void move(Vector3d& p, Matrix3d& R, const NeedleParameters& needle, const Vector2d& kappa, double ds, double dr) {
  const double sign = needle.front_wheel == FrontWheel::published ? 1 : -1;
  const auto turn = [&](const Matrix3d& at, double share) {
    const Vector2d f = slip_of(at, needle);
    const Vector3d w(ds * (kappa.x() - sign * f.y() / needle.wheelbase_mm),
                     ds * (kappa.y() + sign * f.x() / needle.wheelbase_mm), dr);
    const double angle = share * w.norm();
    return angle == 0 ? Matrix3d(Matrix3d::Identity()) : Eigen::AngleAxisd(angle, w.normalized()).toRotationMatrix();
  };
  const Matrix3d middle = R * turn(R, 0.5);
  const Vector2d f = slip_of(middle, needle);
  p += middle * Vector3d(ds * f.x(), ds * f.y(), ds);
  R = R * turn(middle, 1);
}

}  // namespace

std::vector<Vector3d> BruteForce::path(const Script& script, const Motion& readings) const {
  constexpr double kStep_s = 5e-5;
  const BruteForce hooks = *this;  // their memory begins anew with each path
  std::vector<Vector3d> path;
  Instant now{};
  now.R = entry;
  for (const std::size_t node : readings.at) {
    const double until_s = readings.nodes[node].time_s;
    while (now.time_s < until_s - 1e-9) {
      now.step_s = std::min(kStep_s, until_s - now.time_s);
      now.time_s += now.step_s;
      now.base = script.at(now.time_s);
      now.ds_mm = now.dr_rad = 0;
      double s_mm = now.base.insertion_mm;
      double r_rad = now.base.rotation_rad;
      hooks.axes(now, s_mm, r_rad);
      now.ds_mm = s_mm - now.s_mm;
      now.dr_rad = r_rad - now.r_rad;
      Vector2d kappa(needle.curvature_per_mm, 0);
      hooks.curvature(now, kappa);
      move(now.p_mm, now.R, needle, kappa, now.ds_mm, now.dr_rad);
      now.s_mm = s_mm;
      now.r_rad = r_rad;
      hooks.after(now);
    }
    path.push_back(now.p_mm);
  }
  return path;
}

}  // namespace bevel::model::testing
