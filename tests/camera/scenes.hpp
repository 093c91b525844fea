#pragma once
// Random needles for the camera tests: arcs in the plane y-z of {A} as the bicycle draws them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "drivers/camera/planar_view.hpp"
#include "drivers/camera/tracker_config.hpp"
#include "rig/camera/needle_renderer.hpp"

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

struct Needle {
  std::vector<camera::Vector3> path;
  double roll_rad = 0.0;
  rig::SceneConfig scene;
};

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// 12 to 85 mm inserted, curved either way by up to 0.006 / mm, any roll; light, blur and noise of a fair webcam.
inline Needle random_needle(std::mt19937_64& random, uint64_t seed) {
  Needle n;
  n.path = arc(uniform(random, 12.0, 85.0), uniform(random, -0.006, 0.006), uniform(random, -0.08, 0.08));
  n.roll_rad = uniform(random, 0.0, 6.28);
  n.scene.blur_px = uniform(random, 0.6, 1.8);
  n.scene.noise_gray = uniform(random, 0.5, 5.0);
  n.scene.needle_gray = uniform(random, 40.0, 90.0);
  n.scene.grid_gray = uniform(random, 0.0, 20.0);
  n.scene.gain = uniform(random, 0.85, 1.15);
  n.scene.seed = seed;
  for (int i = 0; i < 4; ++i)
    n.scene.bubbles.push_back(
        {{uniform(random, 0.0, 640.0), uniform(random, 60.0, 480.0)}, uniform(random, 1.0, 4.0), 40.0});
  return n;
}

inline camera::TrackerConfig tracker_config() {
  camera::TrackerConfig config;
  config.entry_px = {320.0, 20.0};
  config.entry_half_width_px = 40.0;
  return config;
}

}  // namespace bevel::test
