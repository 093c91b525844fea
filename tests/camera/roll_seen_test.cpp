// SPDX-License-Identifier: MIT
// Two cameras that look at one bevel from two sides see it at two rolls: against the metal itself, a cylinder cut by a
// plane, of which each camera's picture is a shadow.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <tuple>
#include <vector>

#include <bevel/rig/camera/needle_renderer.hpp>

namespace bevel::camera {
namespace {

// A radius of 10.5 px, so that the outline lies between pixels.
constexpr double kRadius_mm = 2.1, kBevel_mm = 12.0, kTip_mm = 40.0;

PlanarViewConfig seen_along(SignedAxis across, SignedAxis depth) {
  PlanarViewConfig view;
  view.px_per_mm = 5.0;
  view.origin_px = depth.sign > 0 ? cv::Point2d(160.0, 20.0) : cv::Point2d(160.0, 300.0);
  view.u_axis = across, view.v_axis = depth;
  return view;
}

rig::SceneConfig plain(double face_gray) {
  rig::SceneConfig scene;
  scene.size_px = {320, 320};
  scene.vignette_gray = scene.grid_mm = scene.noise_gray = scene.blur_px = 0.0;
  scene.needle_diameter_mm = 2.0 * kRadius_mm, scene.bevel_length_mm = kBevel_mm;
  scene.face_gray = face_gray;
  return scene;
}

// The shadow of a straight needle along z, whose bevel's point is toward (cos, sin) of x, y: as dark where a ray along
// the view meets metal. A point is metal if it lies within the cylinder and before the plane of the cut.
bool is_metal(const Vector3& at, double side_rad) {
  if (std::hypot(at[0], at[1]) > kRadius_mm) return false;
  const double toward = (at[0] * std::cos(side_rad) + at[1] * std::sin(side_rad)) / kRadius_mm;
  return at[2] <= kTip_mm - 0.5 * kBevel_mm * (1.0 - toward);
}

TEST(RollSeen, TheShadowIsThatOfTheMetalFromEachSide) {
  constexpr double step_mm = 0.1;
  const double quarter_rad = std::numbers::pi / 2;
  for (const double side_rad : {0.0, 0.6, 1.5, 2.7, -2.0, -0.9}) {
    for (const auto& [across, depth, along] :
         {std::tuple(SignedAxis{WorldAxis::y, 1}, SignedAxis{WorldAxis::z, 1}, 0),
          std::tuple(SignedAxis{WorldAxis::y, -1}, SignedAxis{WorldAxis::z, 1}, 0),
          std::tuple(SignedAxis{WorldAxis::x, 1}, SignedAxis{WorldAxis::z, 1}, 1),
          std::tuple(SignedAxis{WorldAxis::x, -1}, SignedAxis{WorldAxis::z, -1}, 1)}) {
      const PlanarView view(seen_along(across, depth));
      rig::NeedleRenderer renderer(plain(-1.0), view);
      const double roll_rad =
          renderer.roll_seen_rad({0, 0, kTip_mm}, {0, 0, 1}, {std::cos(side_rad), std::sin(side_rad), 0});
      const std::vector<Vector3> path{{0, 0, 0}, {0, 0, 20.0}, {0, 0, kTip_mm}};
      const cv::Mat gray = renderer.render(path, roll_rad).gray;
      const cv::Mat as_the_other = renderer.render(path, roll_rad + quarter_rad).gray;
      int wrong = 0, wrong_as_the_other = 0, metal_px = 0;
      for (int v = 0; v < gray.rows; ++v)
        for (int u = 0; u < gray.cols; ++u) {
          Vector3 at = view.position_mm({static_cast<double>(u), static_cast<double>(v)});
          if (at[2] < kTip_mm - kBevel_mm - 2.0 || at[2] > kTip_mm + 2.0) continue;
          bool metal = false;
          for (double off = -kRadius_mm; off <= kRadius_mm && !metal; off += step_mm) {
            at.at(static_cast<size_t>(along)) = off;
            metal = is_metal(at, side_rad);
          }
          metal_px += metal ? 1 : 0;
          wrong += metal != (gray.at<uchar>(v, u) < 115) ? 1 : 0;
          wrong_as_the_other += metal != (as_the_other.at<uchar>(v, u) < 115) ? 1 : 0;
        }
      ASSERT_GT(metal_px, 500);
      EXPECT_LE(wrong, metal_px / 50) << "side " << side_rad << ", camera along " << along << ": of " << metal_px;
      EXPECT_GT(wrong_as_the_other, metal_px / 20) << "that of a camera a quarter turn further";
    }
  }
}

// Which of the two walls is before the other a shadow does not tell; the bright face does.
TEST(RollSeen, TheFaceIsTurnedToTheCameraWhereThePointIsBehind) {
  for (const auto& [across, side, faces] :
       {std::tuple(WorldAxis::y, Vector3{1, 0, 0}, true), std::tuple(WorldAxis::y, Vector3{-1, 0, 0}, false),
        // x to the right and z down: it looks toward -y.
        std::tuple(WorldAxis::x, Vector3{0, -1, 0}, true), std::tuple(WorldAxis::x, Vector3{0, 1, 0}, false)}) {
    const PlanarView view(seen_along({across, 1}, {WorldAxis::z, 1}));
    rig::NeedleRenderer renderer(plain(140.0), view);
    const double roll_rad = renderer.roll_seen_rad({0, 0, kTip_mm}, {0, 0, 1}, side);
    const cv::Mat gray = renderer.render({{0, 0, 0}, {0, 0, 20.0}, {0, 0, kTip_mm}}, roll_rad).gray;
    const cv::Point2d middle = view.pixel({0, 0, kTip_mm - 0.5 * kBevel_mm});
    EXPECT_NEAR(gray.at<uchar>(cvRound(middle.y), cvRound(middle.x)), faces ? 140 : 60, 3);
  }
}

// A quarter turn of the needle is a quarter turn for every camera, and 90 degrees lie between the two of a rig.
TEST(RollSeen, TurnsWithTheNeedleAndDiffersBetweenCameras) {
  const rig::NeedleRenderer first(plain(-1.0), PlanarView(seen_along({WorldAxis::y, 1}, {WorldAxis::z, 1})));
  const rig::NeedleRenderer second(plain(-1.0), PlanarView(seen_along({WorldAxis::x, 1}, {WorldAxis::z, 1})));
  const auto seen = [](const rig::NeedleRenderer& by, double side_rad) {
    return by.roll_seen_rad({0, 0, kTip_mm}, {0, 0, 1}, {std::cos(side_rad), std::sin(side_rad), 0});
  };
  const auto around = [](double rad) { return std::remainder(rad, 2.0 * std::numbers::pi); };
  for (const double side_rad : {-2.0, 0.0, 0.7, 3.0}) {
    EXPECT_NEAR(around(seen(first, side_rad) - seen(first, 0.0) - side_rad), 0.0, 1e-9);
    EXPECT_NEAR(std::abs(around(seen(first, side_rad) - seen(second, side_rad))), std::numbers::pi / 2, 1e-9);
  }
}

}  // namespace
}  // namespace bevel::camera
