// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <bevel/drivers/camera/planar_view.hpp>
#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

TEST(PlanarView, PixelAndPositionAreInverse) {
  PlanarViewConfig config;
  config.px_per_mm = 5.607;
  config.origin_px = {64.0, 50.0};
  config.u_axis = {WorldAxis::x, -1};
  config.v_axis = {WorldAxis::z, 1};
  const PlanarView view(config);
  const Vector3 p = view.position_mm({64.0 + 5.607, 50.0 + 2 * 5.607});
  EXPECT_NEAR(p[0], -1.0, 1e-12);
  EXPECT_EQ(p[1], 0.0);
  EXPECT_NEAR(p[2], 2.0, 1e-12);
  const cv::Point2d back = view.pixel(p);
  EXPECT_NEAR(back.x, 69.607, 1e-9);
  EXPECT_NEAR(back.y, 61.214, 1e-9);
}

TEST(PlanarView, InformationFollowsTheAxesAndIsZeroAlongTheOpticalAxis) {
  PlanarViewConfig config;
  config.px_per_mm = 10.0;
  config.u_axis = {WorldAxis::y, -1};
  const PlanarView view(config);
  const cv::Matx22d covariance_px2(4.0, 1.0, 1.0, 9.0);
  const Matrix3 info = view.information_per_mm2({0, 0}, covariance_px2);
  for (const size_t i : {0U, 1U, 2U, 3U, 6U}) EXPECT_EQ(info[i], 0.0) << i;
  // By hand: inverse of [4 1; 1 9] is [9 -1; -1 4] / 35; times 10^2; the flipped axis flips the cross term.
  EXPECT_NEAR(info[4], 900.0 / 35.0, 1e-9);
  EXPECT_NEAR(info[8], 400.0 / 35.0, 1e-9);
  EXPECT_NEAR(info[5], 100.0 / 35.0, 1e-9);
  EXPECT_EQ(info[5], info[7]);
}

TEST(PlanarView, ADirectionIsOneAngleInItsPlane) {
  PlanarViewConfig config;
  config.u_axis = {WorldAxis::y, -1};
  const PlanarView view(config);
  const SeenDirection seen = view.direction({0, 0}, {0.6, 0.8}, 0.04);
  for (const auto& [axis, value] : {std::pair(0U, 0.0), {1U, -0.6}, {2U, 0.8}})
    EXPECT_NEAR(seen.direction.at(axis), value, 1e-15);
  const Matrix3& W = seen.information_per_rad2;
  for (const size_t i : {0U, 1U, 2U, 3U, 6U}) EXPECT_EQ(W[i], 0.0) << "nothing out of the picture: " << i;
  for (const size_t r : {1U, 2U}) EXPECT_NEAR(W[3 * r + 1] * -0.6 + W[3 * r + 2] * 0.8, 0.0, 1e-12) << "nor along it";
  EXPECT_NEAR(W[4] + W[8], 1.0 / 0.04, 1e-9);
  EXPECT_NEAR(W[4] * W[8] - W[5] * W[7], 0.0, 1e-9) << "rank 1";
  // Turned by a small angle in the picture, it says that angle: the root of d^T W d, times its standard deviation.
  const double angle_rad = 1e-4, at_rad = std::atan2(0.6, 0.8) + angle_rad;
  const SeenDirection turned = view.direction({0, 0}, {std::sin(at_rad), std::cos(at_rad)}, 0.04);
  double squares = 0.0;
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 3; ++c)
      squares += (turned.direction[r] - seen.direction[r]) * W[3 * r + c] * (turned.direction[c] - seen.direction[c]);
  EXPECT_NEAR(std::sqrt(squares) * 0.2, angle_rad, 1e-10);
}

TEST(PlanarView, BadConfigurationsNameTheKey) {
  struct Case {
    const char* key;
    void (*spoil)(PlanarViewConfig&);
  };
  const Case cases[] = {
      {"px_per_mm", [](PlanarViewConfig& c) { c.px_per_mm = 0.0; }},
      {"px_per_mm", [](PlanarViewConfig& c) { c.px_per_mm = std::nan(""); }},
      {"origin_px", [](PlanarViewConfig& c) { c.origin_px.x = INFINITY; }},
      {"u_axis", [](PlanarViewConfig& c) { c.u_axis.sign = 0; }},
      {"v_axis", [](PlanarViewConfig& c) { c.v_axis.axis = c.u_axis.axis; }},
  };
  for (const Case& bad : cases) {
    PlanarViewConfig config;
    bad.spoil(config);
    try {
      const PlanarView view(config);
      ADD_FAILURE() << bad.key << " was accepted";
    } catch (const ArgumentError& error) {
      EXPECT_NE(std::string(error.what()).find(bad.key), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace bevel::camera
