// SPDX-License-Identifier: MIT
#pragma once
// What spoils pictures, one thing at a time, and how the tracker stands it: for the test and for the study of
// thousands.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <bevel/drivers/camera/tip_tracker.hpp>
#include "tests/camera/scenes.hpp"

namespace bevel::test {

struct Effect {
  const char* name;
  /// Puts the effect into a fair scene whose tip lies at `tip_px`.
  void (*add)(rig::SceneConfig& scene, const cv::Point2d& tip_px, std::mt19937_64& random);
};

inline const std::array<Effect, 15>& effects() {
  using Scene = rig::SceneConfig;
  using Point = cv::Point2d;
  using Random = std::mt19937_64;
  static const std::array<Effect, 15> all{{
      {"a fair webcam", [](Scene&, const Point&, Random&) {}},
      {"lens blur 1.8 to 3 px", [](Scene& s, const Point&, Random& r) { s.blur_px = uniform(r, 1.8, 3.0); }},
      {"noise 5 to 12 gray", [](Scene& s, const Point&, Random& r) { s.noise_gray = uniform(r, 5.0, 12.0); }},
      {"contrast 25 to 50 gray",
       [](Scene& s, const Point&, Random& r) { s.needle_gray = s.background_gray - uniform(r, 25.0, 50.0); }},
      {"printed grid 20 to 45 gray", [](Scene& s, const Point&, Random& r) { s.grid_gray = uniform(r, 20.0, 45.0); }},
      {"40 bubbles",
       [](Scene& s, const Point&, Random& r) {
         for (int i = 0; i < 40; ++i)
           s.bubbles.push_back({{uniform(r, 0.0, 640.0), uniform(r, 0.0, 480.0)}, uniform(r, 1.0, 5.0), 40.0});
       }},
      {"glare near the tip",
       [](Scene& s, const Point& tip, Random& r) {
         const Point off(uniform(r, -60.0, 60.0), uniform(r, -60.0, 60.0));
         s.glare.push_back({tip + off, uniform(r, 10.0, 40.0), uniform(r, 30.0, 120.0)});
       }},
      {"uneven light, to 40 %",
       [](Scene& s, const Point&, Random& r) {
         s.light_gradient = {uniform(r, -0.4, 0.4), uniform(r, -0.4, 0.4)};
         s.vignette_gray = 50.0;
       }},
      {"pale face of the bevel",
       [](Scene& s, const Point&, Random& r) {
         s.face_gray = s.needle_gray + uniform(r, 0.2, 0.7) * (s.background_gray - s.needle_gray);
       }},
      {"something before the shaft",
       [](Scene& s, const Point& tip, Random& r) {
         const double height = uniform(r, 5.0, 30.0);
         s.occluders.push_back(
             {{0.0, tip.y - uniform(r, 40.0, 120.0) - height, 640.0, height}, uniform(r, 90.0, 200.0)});
       }},
      {"something before the tip",
       [](Scene& s, const Point& tip, Random& r) {
         const double up = uniform(r, 2.0, 15.0);
         s.occluders.push_back({{tip.x - 40.0, tip.y - up, 80.0, up + 20.0}, uniform(r, 90.0, 130.0)});
       }},
      {"the same, as light as the gel",
       [](Scene& s, const Point& tip, Random& r) {
         const double up = uniform(r, 2.0, 15.0);
         s.occluders.push_back({{tip.x - 40.0, tip.y - up, 80.0, up + 20.0}, uniform(r, 160.0, 180.0)});
       }},
      {"lens distortion, k1 to 0.1",
       [](Scene& s, const Point&, Random& r) {
         s.lens = {uniform(r, -0.1, 0.1), uniform(r, -0.02, 0.02)};
       }},
      {"refraction, 20 to 80 mm of gel",
       [](Scene& s, const Point&, Random& r) { s.refraction.gel_depth_mm = uniform(r, 20.0, 80.0); }},
      {"rolling shutter, to 8 px a frame",
       [](Scene& s, const Point&, Random& r) {
         s.shutter.motion_px = {uniform(r, -8.0, 8.0), uniform(r, -8.0, 8.0)};
       }},
  }};
  return all;
}

struct EffectFigures {
  int frames = 0, ok = 0, beyond_6_px = 0;
  std::vector<double> across_px, along_px;  ///< signed, of those that are ok
  double squared = 0.0;                     ///< mean over both axes, 1 if honest
  double bias_along_px = 0.0;
};

/// Errors are against where the tip is seen: what lens and refraction do to positions is not the tracker's to mend.
inline EffectFigures stand(const Effect& effect, int frames, uint64_t seed) {
  std::mt19937_64 random(seed);
  const camera::PlanarView view(side_view());
  EffectFigures f;
  for (int i = 0; i < frames; ++i) {
    Needle needle = random_needle(random, seed + static_cast<uint64_t>(i));
    effect.add(needle.scene, view.pixel(needle.path.back()), random);
    const rig::NeedlePicture picture = rig::NeedleRenderer(needle.scene, view).render(needle.path, needle.roll_rad);
    camera::TipTracker tracker(tracker_config(), view.px_per_mm());
    const camera::TipResult tip = tracker.track({1 + i, i, 0, picture.gray});
    ++f.frames;
    if (tip.status != camera::TipStatus::ok) continue;
    ++f.ok;
    const cv::Vec2d e(tip.tip_px.x - picture.tip_px.x, tip.tip_px.y - picture.tip_px.y);
    const cv::Vec2d& t = picture.direction_px;
    f.along_px.push_back(e.dot(t));
    f.across_px.push_back(e[0] * t[1] - e[1] * t[0]);
    f.squared += 0.5 * e.dot(tip.covariance_px2.inv() * e);
    f.bias_along_px += f.along_px.back();
    f.beyond_6_px += cv::norm(e) > 6.0 ? 1 : 0;
  }
  f.squared /= std::max(1, f.ok);
  f.bias_along_px /= std::max(1, f.ok);
  return f;
}

/// Value below which the share `share` of the sizes of `values` lies; 0 of none.
inline double size_below(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  for (double& v : values) v = std::abs(v);
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
}

}  // namespace bevel::test
