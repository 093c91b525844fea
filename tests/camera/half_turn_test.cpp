// SPDX-License-Identifier: MIT
// A needle that is turned over at rest each 10 mm changes the sign of its curvature at once. What its tip is seen aside
// by, as it goes on from the turn: a filter that averages many frames takes for curvature whatever they have in common.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include <bevel/drivers/camera/tip_tracker.hpp>
#include "tests/camera/scenes.hpp"

namespace bevel::camera {
namespace {

TEST(HalfTurns, TheTipIsNotSeenAsideOfThePathAfterOne) {
  constexpr uint64_t seed = 20261124;
  constexpr int of_each = 60;
  std::mt19937_64 random(seed);
  PlanarViewConfig config = test::side_view();
  config.px_per_mm = 4.4;  // as the demo's cameras
  const PlanarView view(config);
  std::array<double, 10> toward_mm{}, claimed_mm2{}, heading_rad{};
  double squared = 0.0, squared_heading = 0.0;
  int found = 0;
  for (size_t since = 0; since < toward_mm.size(); ++since) {
    int ok = 0;
    for (int i = 0; i < of_each; ++i) {
      const double length_mm = 10.0 * (2 + i % 5) + static_cast<double>(since) + 0.5;
      const test::TurnedOver needle =
          test::turned_over(length_mm, i % 2 == 0 ? 0.005 : -0.005, test::uniform(random, -0.05, 0.05));
      rig::SceneConfig scene;
      scene.seed = seed + static_cast<uint64_t>(100 * since) + static_cast<uint64_t>(i);
      const double roll_rad = test::uniform(random, 0.0, 6.28);  // cameras look at it from anywhere beside it
      const rig::NeedlePicture picture = rig::NeedleRenderer(scene, view).render(needle.path, roll_rad);
      TipTracker tracker(test::tracker_config(), view.px_per_mm());
      const TipResult tip = tracker.track({1, 0, 0, picture.gray});
      if (tip.status != TipStatus::ok) continue;
      ++ok;
      const cv::Vec2d& t = picture.direction_px;
      const cv::Vec2d right(t[1], -t[0]);  // +u, as +y
      const cv::Vec2d e(tip.tip_px.x - picture.tip_px.x, tip.tip_px.y - picture.tip_px.y);
      const double variance_px2 = right.dot(tip.covariance_px2 * right);
      const double off_rad = std::asin(right.dot(tip.direction_px));
      toward_mm[since] += needle.side * e.dot(right) / view.px_per_mm();
      claimed_mm2[since] += variance_px2 / (view.px_per_mm() * view.px_per_mm());
      heading_rad[since] += needle.side * off_rad;
      squared += e.dot(right) * e.dot(right) / variance_px2;
      squared_heading += off_rad * off_rad / tip.direction_variance_rad2;
    }
    ASSERT_GE(ok, of_each * 9 / 10);
    toward_mm[since] /= ok, claimed_mm2[since] /= ok, heading_rad[since] /= ok;
    found += ok;
    std::printf("%.1f mm after a half turn: seen aside, toward the bend, by %+.4f mm, sd claimed %.4f; heading %+.4f\n",
                static_cast<double>(since) + 0.5, toward_mm[since], std::sqrt(claimed_mm2[since]), heading_rad[since]);
  }
  double mean_mm = 0.0, largest_mm = 0.0;
  for (const double mm : toward_mm) {
    mean_mm += mm / static_cast<double>(toward_mm.size());
    largest_mm = std::max(largest_mm, std::abs(mm));
  }
  std::printf("seed %llu, %d frames: mean %+.4f mm, largest %.4f; squared error across %.2f, of headings %.2f\n",
              static_cast<unsigned long long>(seed), found, mean_mm, largest_mm, squared / found,
              squared_heading / found);
  // What a picture does not tell of a bend that lies within the cut remains, inside of what is claimed.
  EXPECT_LT(std::abs(mean_mm), 0.02);
  EXPECT_LT(largest_mm, 0.045);
  EXPECT_LT(squared / found, 1.9) << "a bend is not in the covariance";
  EXPECT_LT(squared_heading / found, 1.6);
}

}  // namespace
}  // namespace bevel::camera
