// SPDX-License-Identifier: MIT
#include <bevel/controller/obstacle.hpp>

#include <algorithm>

namespace bevel::controller {

// The squared distance between a point of each line is convex in both: its least within the unit square is found along
// one line for the best point of the other, clamped, and back (Ericson, Real-Time Collision Detection, 2005, 5.1.9).
double distance_mm(const Obstacle& obstacle, const Eigen::Vector3d& a_mm, const Eigen::Vector3d& b_mm) {
  const Eigen::Vector3d u = obstacle.to_mm - obstacle.from_mm, v = b_mm - a_mm, between = obstacle.from_mm - a_mm;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), ub = u.dot(between), vb = v.dot(between);
  const auto share = [](double part, double whole) { return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0.0; };
  const double parallel = uu * vv - uv * uv;
  double s = parallel > 1e-12 * uu * vv ? share(uv * vb - ub * vv, parallel) : 0.0;
  const double t = share(vb + s * uv, vv);
  s = share(t * uv - ub, uu);
  return (between + s * u - t * v).norm() - obstacle.radius_mm;
}

}  // namespace bevel::controller
