// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// One calibrated camera: lens, pose in {A}, and the flat wall of gel in front of it, if there is one. Lengths in mm.
/// {C} has its origin in the lens, x to the right and y down in the image, z ahead. projection.hpp contains the
/// equations.
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include <bevel/drivers/camera/calibration/projection.hpp>

namespace bevel::camera {

/// Lens of a camera.
struct Lens {
  cv::Size picture_px;                               ///< image size for which the parameters are valid, px
  std::array<double, kLensParameters> parameters{};  ///< indexed by LensParameter
};

/// Flat wall between the camera and {A}: all of {A} lies behind it.
struct FlatWall {
  /// Indexed by WallParameter.
  std::array<double, kWallParameters> parameters{0.0, 0.0, 100.0, 1.333};
  Pane pane;  ///< pane between air and gel
};

/// Half-line.
struct Ray {
  cv::Vec3d origin_mm;  ///< origin, mm
  cv::Vec3d direction;  ///< unit vector
};

/// A calibrated camera.
struct CameraModel {
  int number = 0;  ///< camera number, as in [[camera]] and TIP_MEASUREMENT
  Lens lens;       ///< lens
  /// Rotation matrix: p_C = R_CA p_A + p_CA_mm.
  cv::Matx33d R_CA = cv::Matx33d::eye();
  cv::Vec3d p_CA_mm;             ///< origin of {A} in {C}, mm
  std::optional<FlatWall> wall;  ///< wall in front of the camera; empty: none

  /// Computes the pixel at which a point is seen.
  /// @param p_A_mm point in {A}, mm
  /// @return pixel (u, v); empty if the camera cannot see the point: behind the camera, or in front of the wall
  std::optional<cv::Point2d> pixel(const cv::Vec3d& p_A_mm) const;
  /// Computes the ray of a pixel.
  /// @param pixel pixel (u, v)
  /// @return ray in {A}; with a wall, the ray in the gel from the wall on. Empty if the lens model has no inverse, far
  /// outside
  ///   the image
  std::optional<Ray> ray(const cv::Point2d& pixel) const;
};

/// Checks a camera.
/// @param model camera
/// @throws ArgumentError naming the camera, the key, the value and what is allowed
void check(const CameraModel& model);

/// Computes the direction of the light at a pixel.
/// @param lens  lens
/// @param pixel pixel (u, v)
/// @return x/z and y/z in {C}; empty if the distortion has no inverse there
std::optional<cv::Vec2d> undistort(const Lens& lens, const cv::Point2d& pixel);

/// Computes the ray in the gel of a direction in air.
/// @param wall      wall
/// @param direction unit vector from the camera in air, in {C}
/// @return ray in {C}; empty if the direction does not meet the wall
std::optional<Ray> refract(const FlatWall& wall, const cv::Vec3d& direction);

/// Computes the point nearest to all rays, with equal weights.
/// @param rays rays
/// @return point, mm; empty if the rays are parallel
std::optional<cv::Vec3d> nearest_to_rays(const std::vector<Ray>& rays);

}  // namespace bevel::camera
