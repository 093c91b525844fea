// SPDX-License-Identifier: MIT
#pragma once
// One calibrated camera: lens, where it stands in {A}, and the flat wall of gel it looks through, if there is one.
// Lengths in mm; {C} has its origin in the lens, x to the right and y down in the picture, z ahead. The equations stand
// in projection.hpp.
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include <bevel/drivers/camera/calibration/projection.hpp>

namespace bevel::camera {

struct Lens {
  cv::Size picture_px;  ///< the only size of picture of which the rest is true
  std::array<double, kLensParameters> parameters{};
};

/// Everything of {A} lies behind it.
struct FlatWall {
  std::array<double, kWallParameters> parameters{0.0, 0.0, 100.0, 1.333};
  Pane pane;
};

/// Half a line, along unit `direction` from `origin_mm`.
struct Ray {
  cv::Vec3d origin_mm;
  cv::Vec3d direction;
};

struct CameraModel {
  int number = 0;  ///< as in [[camera]] and TIP_MEASUREMENT
  Lens lens;
  cv::Matx33d R_CA = cv::Matx33d::eye();  ///< p_C = R_CA p_A + p_CA_mm
  cv::Vec3d p_CA_mm;
  std::optional<FlatWall> wall;

  /// Pixel of a point of {A}; nothing if the camera cannot see it: behind it, or before its wall.
  std::optional<cv::Point2d> pixel(const cv::Vec3d& p_A_mm) const;
  /// What is seen at a pixel: a ray in {A}, in the gel if there is a wall, from the wall on. Nothing where the lens's
  /// equations have no inverse, far outside the picture.
  std::optional<Ray> ray(const cv::Point2d& pixel) const;
};

/// Throws ArgumentError naming the camera, the key, the value and what is allowed.
void check(const CameraModel& model);

/// x/z, y/z of the light that falls on a pixel; nothing where the lens folds over.
std::optional<cv::Vec2d> undistort(const Lens& lens, const cv::Point2d& pixel);

/// Through the wall: a unit direction in air from the camera to the ray in the gel, in {C}. Nothing if it never meets
/// the wall.
std::optional<Ray> refract(const FlatWall& wall, const cv::Vec3d& direction);

/// Point next to all rays, each of the same weight; nothing if they are parallel.
std::optional<cv::Vec3d> nearest_to_rays(const std::vector<Ray>& rays);

}  // namespace bevel::camera
