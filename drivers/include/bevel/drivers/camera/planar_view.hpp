// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// View of one plane in a rectified image: a constant number of pixels per mm, image axes parallel to axes of {A}.
/// Valid for a camera that looks perpendicularly at the plane in which the needle bends, and for images rectified
/// beforehand; without lens distortion and refraction.
#include <bevel/drivers/camera/view.hpp>

namespace bevel::camera {

/// Axes of {A}.
enum class WorldAxis {
  x = 0,  ///< x of {A}
  y = 1,  ///< y of {A}
  z = 2   ///< z of {A}
};

/// Axis of {A} parallel to an image axis.
struct SignedAxis {
  WorldAxis axis = WorldAxis::z;  ///< axis of {A}
  int sign = 1;                   ///< +1 if the coordinate grows with the pixel, otherwise -1
};

/// Settings of a planar view.
struct PlanarViewConfig {
  double px_per_mm = 5.0;           ///< scale, px/mm
  cv::Point2d origin_px{0.0, 0.0};  ///< pixel (u, v) of the origin of {A}, the entry point; may lie outside the image
  SignedAxis u_axis{WorldAxis::y, 1};  ///< axis along columns, left to right
  SignedAxis v_axis{WorldAxis::z, 1};  ///< axis along rows, top to bottom
};

/// View of one plane.
class PlanarView : public View {
 public:
  /// Creates a view.
  /// @param config settings
  /// @throws ArgumentError naming the key, the value and what is allowed
  explicit PlanarView(const PlanarViewConfig& config);

  Vector3 position_mm(const cv::Point2d& pixel) const override;
  cv::Point2d pixel(const Vector3& position_mm) const override;
  Matrix3 information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const override;
  SeenDirection direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px, double variance_rad2) const override;
  double px_per_mm() const override { return config_.px_per_mm; }
  /// @return settings
  const PlanarViewConfig& config() const { return config_; }

 private:
  PlanarViewConfig config_;
};

}  // namespace bevel::camera
