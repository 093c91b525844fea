// SPDX-License-Identifier: MIT
// What the cameras make of the tip's path.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "proof/needle_path.hpp"

namespace bevel::proof {
namespace {

using Eigen::Vector3d;

// Of what is known every kStep_s.
template <class Value>
Value at(const std::vector<Value>& path, double time_s) {
  const double place = std::clamp(time_s / kStep_s, 0.0, static_cast<double>(path.size() - 1));
  const std::size_t before = std::min(static_cast<std::size_t>(place), path.size() - 2);
  const double share = place - static_cast<double>(before);
  return (1.0 - share) * path[before] + share * path[before + 1];
}

// A pinhole's image is in proportion to 1 / distance (Hartley and Zisserman, Multiple View Geometry), and the
// millimetres per pixel are those at the insertion axis: nearer by x is larger by x / distance. The first camera looks
// along x and gives y and z, the second along y and gives x.
void magnify(Vector3d& tip, const HiddenPhysics& physics) {
  const double first = 1.0 + physics.perspective_per_mm * tip.x();
  const double second = 1.0 + physics.perspective_per_mm * tip.y();
  tip.x() *= second;
  tip.y() *= first;
  tip.z() = physics.perspective_centre_mm + (tip.z() - physics.perspective_centre_mm) * first;
}

// The first camera, which looks along x and gives y and z.
void distort(Vector3d& tip, const HiddenPhysics& physics) {
  if (physics.refraction != 0.0) {
    const double z = tip.z() - physics.refraction_centre_mm;
    const double square = (tip.y() * tip.y() + z * z) / 2500.0;
    const double stretch = 1.0 + physics.refraction * square * (1.0 + 0.15 * physics.departure * (square - 0.4));
    tip.y() *= stretch;
    tip.z() = physics.refraction_centre_mm + z * stretch;
  }
  const double c = std::cos(physics.camera_about_x_rad);
  const double s = std::sin(physics.camera_about_x_rad);
  const double y = physics.camera_ratio * (c * tip.y() + s * tip.z());
  const double z = physics.camera_ratio * (c * tip.z() - s * tip.y());
  tip.y() = y;
  tip.z() = z;
}

// The frame on which the first camera's stand is fixed recoils as the carriage starts and stops, and rings on: an
// oscillator of little damping (Den Hartog, Mechanical Vibrations) that each change of speed sets going. Along
// z, every kStep_s; the carriage's speed is read from the tip's depth.
std::vector<double> sway_of(const TipPath& path, const HiddenPhysics& physics) {
  constexpr double kDamping = 0.05;  // of the critical
  constexpr double kUnit_mm_s = 10;  // the change of speed of which sway_mm is said
  const double natural_rad_s = 2.0 * std::numbers::pi * physics.sway_hz;
  const double decay_per_s = kDamping * natural_rad_s;
  const double ringing_rad_s = natural_rad_s * std::sqrt(1.0 - kDamping * kDamping);
  const double c = std::exp(-decay_per_s * kStep_s) * std::cos(ringing_rad_s * kStep_s);
  const double s = std::exp(-decay_per_s * kStep_s) * std::sin(ringing_rad_s * kStep_s) / ringing_rad_s;
  std::vector<double> sway_mm{0};
  double rate_mm_s = 0;
  double speed_mm_s = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double speed_now_mm_s = (path[i].z() - path[i - 1].z()) / kStep_s;
    rate_mm_s += physics.sway_mm * natural_rad_s * (speed_now_mm_s - speed_mm_s) / kUnit_mm_s;
    speed_mm_s = speed_now_mm_s;
    const double x_mm = sway_mm.back();
    sway_mm.push_back(c * x_mm + s * (rate_mm_s + decay_per_s * x_mm));
    rate_mm_s = c * rate_mm_s - s * (decay_per_s * rate_mm_s + natural_rad_s * natural_rad_s * x_mm);
  }
  return sway_mm;
}

}  // namespace

Eigen::Matrix3Xd view(const TipPath& path, const std::vector<double>& times_s, const HiddenPhysics& physics) {
  Eigen::Matrix3Xd seen(3, static_cast<Eigen::Index>(times_s.size()));
  // The shutter is open for a while.
  const double half_exposure_s = physics.latency_s > 0.0 ? 0.006 * physics.departure : 0.0;
  LooseGear sag(30.0, 6.0);
  const std::vector<double> sway_mm = physics.sway_mm != 0.0 ? sway_of(path, physics) : std::vector<double>{};
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double t = times_s[i] - physics.latency_s;
    Eigen::Vector3d tip = 0.5 * at(path, t) + 0.25 * (at(path, t - half_exposure_s) + at(path, t + half_exposure_s));
    const double z = tip.z();
    if (physics.perspective_per_mm != 0.0) magnify(tip, physics);
    distort(tip, physics);
    if (physics.camera_hysteresis_mm != 0.0) tip.y() += physics.camera_hysteresis_mm * (z - sag.follow(z)) / 15.0;
    tip.y() += physics.camera_drift_mm_per_s * times_s[i];
    if (!sway_mm.empty()) tip.z() += at(sway_mm, t);
    seen.col(static_cast<Eigen::Index>(i)) = tip;
  }
  return seen;
}

}  // namespace bevel::proof
