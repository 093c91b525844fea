#include <gtest/gtest.h>

#include <stdexcept>

#include "drivers/camera/planar_view.hpp"

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
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(bad.key), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("allowed"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace bevel::camera
