// SPDX-License-Identifier: MIT
// The camera's equations against others: Fermat for the wall, OpenCV for the lens, differences for derivatives.
#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>

#include <bevel/error.hpp>
#include "tests/calibration/true_optics.hpp"

namespace bevel::camera {
namespace {

using test::TrueCamera;
using test::TrueWall;

TrueCamera tilted(double index, double pane_mm) {
  TrueCamera c;
  c.wall = TrueWall{cv::normalize(cv::Vec3d(0.3, -0.2, 1)), 90, index, pane_mm, 1.52};
  c.R = test::turned(0.2, -0.4, 0.1);
  c.t_mm = {3, -8, 20};
  return c;
}

TEST(Projection, ThroughAWallIsThePathOfLeastTime) {
  double worst_px = 0, worst_mm = 0;
  for (const auto& [index, pane_mm] : {std::pair(1.333, 0.0), {1.333, 6.0}, {1.0, 0.0}, {1.47, 3.0}}) {
    const TrueCamera truth = tilted(index, pane_mm);
    const CameraModel model = truth.model(0);
    for (int x = -70; x <= 70; x += 20)
      for (int y = -50; y <= 50; y += 20)
        for (const double z : {150.0, 220.0}) {
          const cv::Vec3d p = truth.in_world({1.0 * x, 1.0 * y, z});
          const cv::Point2d expected = truth.pixel(p, true);
          const auto got = model.pixel(p);
          ASSERT_TRUE(got);
          worst_px = std::max(worst_px, cv::norm(*got - expected));
          if (expected.x < 0 || expected.y < 0 || expected.x > 639 || expected.y > 479) continue;
          // And back: the ray of that pixel passes through the point.
          const auto ray = model.ray(expected);
          ASSERT_TRUE(ray);
          EXPECT_NEAR(cv::norm(ray->direction), 1.0, 1e-12);
          const cv::Vec3d off = p - ray->origin_mm;
          EXPECT_GT(off.dot(ray->direction), 0.0);
          worst_mm = std::max(worst_mm, cv::norm(off - off.dot(ray->direction) * ray->direction));
        }
  }
  std::printf("against Fermat: %.1e px, back through the point: %.1e mm\n", worst_px, worst_mm);
  EXPECT_LT(worst_px, 1e-6);
  EXPECT_LT(worst_mm, 1e-6);
}

TEST(Projection, AWallOfAirIsNone) {
  TrueCamera truth = tilted(1.0, 0.0);
  const CameraModel with = truth.model(0);
  truth.wall.reset();
  const CameraModel without = truth.model(0);
  const cv::Vec3d p = truth.in_world({20, -10, 200});
  EXPECT_LT(cv::norm(*with.pixel(p) - *without.pixel(p)), 1e-9);
}

TEST(Projection, UndistortsAsOpenCvDistorts) {
  const TrueCamera truth;
  const CameraModel model = truth.model(0);
  for (int u = 0; u < 640; u += 53)
    for (int v = 0; v < 480; v += 47) {
      const auto xy = undistort(model.lens, cv::Point2d(u, v));
      ASSERT_TRUE(xy) << u << " " << v;
      std::vector<cv::Point2d> back;
      cv::projectPoints(std::vector<cv::Point3d>{{(*xy)[0], (*xy)[1], 1.0}}, cv::Vec3d(), cv::Vec3d(), truth.K(),
                        truth.distortion, back);
      EXPECT_LT(cv::norm(back.front() - cv::Point2d(u, v)), 1e-9);
    }
}

// A lens that folds over gives no second answer, and neither does what lies behind the camera or before the wall.
TEST(Projection, WhatCannotBeSeenHasNoPixelAndNoRay) {
  TrueCamera truth = tilted(1.333, 0.0);
  truth.distortion = {-0.4, 0, 0, 0, 0};
  const CameraModel model = truth.model(0);
  EXPECT_FALSE(model.pixel(truth.in_world({0, 0, -50}))) << "behind";
  EXPECT_FALSE(model.pixel(truth.in_world({0, 0, 40}))) << "before the wall";
  EXPECT_FALSE(model.pixel(truth.in_world({500, 0, 200}))) << "beyond the fold, at r = 0.9";
  EXPECT_FALSE(model.ray({20000, 240})) << "no direction is seen there";
  EXPECT_TRUE(model.pixel(truth.in_world({10, 10, 200})));
}

TEST(Projection, JetsHaveTheDerivatives) {
  using Jet = ceres::Jet<double, 7>;
  const Pane pane{4.0, 1.52};
  const double values[7] = {0.2, -0.1, 80.0, 1.35, 20.0, -30.0, 170.0};  // wall, point
  const auto by_double = [&](const double* v, double* d) { return direction_through_wall(v, pane, v + 4, d); };
  Jet jets[7], direction[3];
  for (int i = 0; i < 7; ++i) jets[i] = Jet(values[i], i);
  ASSERT_TRUE(direction_through_wall(jets, pane, jets + 4, direction));
  for (int i = 0; i < 7; ++i) {
    const double h = 1e-5 * std::max(1.0, std::abs(values[i]));
    double up[7], down[7], d_up[3], d_down[3];
    std::copy_n(values, 7, up), std::copy_n(values, 7, down);
    up[i] += h, down[i] -= h;
    ASSERT_TRUE(by_double(up, d_up) && by_double(down, d_down));
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(direction[k].v[i], (d_up[k] - d_down[k]) / (2 * h), 1e-7) << "direction " << k << " by " << i;
  }
  // Straight through, where the angle has no derivative and the direction has.
  jets[0] = Jet(0.0, 0), jets[1] = Jet(0.0, 1), jets[4] = Jet(0.0, 4), jets[5] = Jet(0.0, 5);
  ASSERT_TRUE(direction_through_wall(jets, pane, jets + 4, direction));
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(direction[k].v.allFinite());
}

TEST(Projection, BadModelsNameTheKey) {
  struct Case {
    const char* key;
    void (*spoil)(CameraModel&);
  };
  const Case cases[] = {
      {"number", [](CameraModel& m) { m.number = 16; }},
      {"image_width", [](CameraModel& m) { m.lens.picture_px.width = 0; }},
      {"fx", [](CameraModel& m) { m.lens.parameters[kFx] = -900; }},
      {"cy", [](CameraModel& m) { m.lens.parameters[kCy] = std::nan(""); }},
      {"distortion_coefficients 1", [](CameraModel& m) { m.lens.parameters[kK2] = INFINITY; }},
      {"rotation_camera_from_A", [](CameraModel& m) { m.R_CA(0, 0) += 0.01; }},
      {"translation_camera_from_A_mm", [](CameraModel& m) { m.p_CA_mm[1] = std::nan(""); }},
      {"wall index", [](CameraModel& m) { m.wall->parameters[kIndex] = 0.9; }},
      {"wall distance_mm", [](CameraModel& m) { m.wall->parameters[kDistance] = -1; }},
      {"wall normal", [](CameraModel& m) { m.wall->parameters[kNormalX] = 1; }},
      {"pane_mm", [](CameraModel& m) { m.wall->pane.thickness_mm = -1; }},
  };
  for (const Case& bad : cases) {
    CameraModel model = tilted(1.333, 0.0).model(2);
    check(model);
    bad.spoil(model);
    try {
      check(model);
      ADD_FAILURE() << bad.key << " was accepted";
    } catch (const ArgumentError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find(bad.key), std::string::npos) << what;
      EXPECT_NE(what.find("allowed"), std::string::npos) << what;
    }
  }
}

}  // namespace
}  // namespace bevel::camera
