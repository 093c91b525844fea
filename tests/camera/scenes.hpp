// SPDX-License-Identifier: MIT
#pragma once
// Random needles for the camera tests: arcs in the plane y-z of {A} as the bicycle draws them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <bevel/drivers/camera/planar_view.hpp>
#include <bevel/drivers/camera/tracker_config.hpp>
#include <bevel/rig/camera/needle_renderer.hpp>

namespace bevel::test {

inline camera::PlanarViewConfig side_view() {
  camera::PlanarViewConfig view;
  view.px_per_mm = 5.0;
  view.origin_px = {320.0, 20.0};
  return view;
}

/// Points every half mm of an arc of `curvature_per_mm` that starts at the origin of {A} with heading `tilt_rad`.
inline std::vector<camera::Vector3> arc(double length_mm, double curvature_per_mm, double tilt_rad) {
  std::vector<camera::Vector3> path{{0.0, 0.0, 0.0}};
  const int steps = std::max(2, static_cast<int>(std::ceil(length_mm / 0.5)));
  const double step_mm = length_mm / steps;
  double y = 0.0;
  double z = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double heading = tilt_rad + curvature_per_mm * (i + 0.5) * step_mm;
    y += step_mm * std::sin(heading);
    z += step_mm * std::cos(heading);
    path.push_back({0.0, y, z});
  }
  return path;
}

/// A needle in space: it enters with these slopes in the plane y-z and out of it, and bends by `curvature_per_mm` to a
/// side that turns by `turn_rad_per_mm` as it goes in, from `roll_rad` (0: toward +y). Points every half mm.
struct SpaceCurve {
  double length_mm = 60.0;
  double curvature_per_mm = 0.0;
  double slope_y_rad = 0.0, slope_x_rad = 0.0;
  double roll_rad = 0.0, turn_rad_per_mm = 0.0;
};
struct SpacePath {
  std::vector<camera::Vector3> points_mm;
  cv::Vec3d tangent;  ///< at the last point, unit vector in {A}
};
inline SpacePath space_path(const SpaceCurve& c) {
  constexpr double step_mm = 0.1;
  constexpr int kept_every = 5;
  const auto turned = [](const cv::Vec3d& v, const cv::Vec3d& axis, double angle_rad) {
    return cv::Vec3d(v * std::cos(angle_rad) + axis.cross(v) * std::sin(angle_rad) +
                     axis * axis.dot(v) * (1.0 - std::cos(angle_rad)));
  };
  SpacePath path;
  cv::Vec3d p(0.0, 0.0, 0.0);
  cv::Vec3d& t = path.tangent;
  t = cv::Vec3d(std::sin(c.slope_x_rad), std::cos(c.slope_x_rad) * std::sin(c.slope_y_rad),
                std::cos(c.slope_x_rad) * std::cos(c.slope_y_rad));
  cv::Vec3d side = cv::normalize(cv::Vec3d(0.0, 1.0, 0.0) - t[1] * t);
  const int steps = std::max(2 * kept_every, static_cast<int>(c.length_mm / step_mm));
  path.points_mm.push_back({0.0, 0.0, 0.0});
  for (int i = 0; i < steps; ++i) {
    const cv::Vec3d toward = turned(side, t, c.roll_rad + c.turn_rad_per_mm * (i + 0.5) * step_mm);
    const cv::Vec3d axis = cv::normalize(t.cross(toward));
    p += step_mm * turned(t, axis, 0.5 * c.curvature_per_mm * step_mm);
    t = turned(t, axis, c.curvature_per_mm * step_mm);
    side = turned(side, axis, c.curvature_per_mm * step_mm);
    if (i % kept_every == kept_every - 1 || i == steps - 1) path.points_mm.push_back({p[0], p[1], p[2]});
  }
  return path;
}

/// A needle in the plane y-z that was turned over at rest each 10 mm.
struct TurnedOver {
  std::vector<camera::Vector3> path;
  double side = 1.0;  ///< +1 where the last piece bends toward +y, -1 toward -y
  double heading_rad = 0.0;
};
inline TurnedOver turned_over(double length_mm, double first_curvature_per_mm, double slope_rad) {
  constexpr double step_mm = 0.1, each_mm = 10.0;
  TurnedOver needle;
  double y = 0.0, z = 0.0;
  double& heading_rad = needle.heading_rad = slope_rad;
  needle.path.push_back({0.0, y, z});
  const int steps = static_cast<int>(std::lround(length_mm / step_mm));
  for (int i = 0; i < steps; ++i) {
    const bool over = static_cast<int>((i + 0.5) * step_mm / each_mm) % 2 == 1;
    const double bend_rad = (over ? -1.0 : 1.0) * first_curvature_per_mm * step_mm;
    needle.side = bend_rad > 0.0 ? 1.0 : -1.0;
    y += step_mm * std::sin(heading_rad + 0.5 * bend_rad), z += step_mm * std::cos(heading_rad + 0.5 * bend_rad);
    heading_rad += bend_rad;
    if (i % 5 == 4 || i == steps - 1) needle.path.push_back({0.0, y, z});
  }
  return needle;
}

struct Needle {
  std::vector<camera::Vector3> path;
  double roll_rad = 0.0;
  rig::SceneConfig scene;
};

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Light, blur, noise and bubbles of a fair webcam.
inline rig::SceneConfig random_scene(std::mt19937_64& random, uint64_t seed) {
  rig::SceneConfig scene;
  scene.blur_px = uniform(random, 0.6, 1.8);
  scene.noise_gray = uniform(random, 0.5, 5.0);
  scene.needle_gray = uniform(random, 40.0, 90.0);
  scene.grid_gray = uniform(random, 0.0, 20.0);
  scene.gain = uniform(random, 0.85, 1.15);
  scene.seed = seed;
  for (int i = 0; i < 4; ++i)
    scene.bubbles.push_back(
        {{uniform(random, 0.0, 640.0), uniform(random, 60.0, 480.0)}, uniform(random, 1.0, 4.0), 40.0});
  return scene;
}

/// 12 to 85 mm inserted, curved either way by up to 0.006 / mm, any roll; light, blur and noise of a fair webcam.
inline Needle random_needle(std::mt19937_64& random, uint64_t seed) {
  Needle n;
  n.path = arc(uniform(random, 12.0, 85.0), uniform(random, -0.006, 0.006), uniform(random, -0.08, 0.08));
  n.roll_rad = uniform(random, 0.0, 6.28);
  n.scene = random_scene(random, seed);
  return n;
}

/// Nothing is said of where the needle comes in but the side.
inline camera::TrackerConfig tracker_config() { return {}; }

/// For what a picture cannot tell.
inline camera::TrackerConfig with_entry() {
  camera::TrackerConfig config;
  config.entry_px = {320.0, 20.0};
  config.entry_half_width_px = 40.0;
  return config;
}

}  // namespace bevel::test
