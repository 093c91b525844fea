// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Interface of the geometry of one camera: relation of pixels to points of {A} (mm; origin at the entry point, z into
/// the tissue).
#include <array>
#include <opencv2/core.hpp>
#include <optional>

namespace bevel::camera {

using Vector3 = std::array<double, 3>;  ///< along x, y, z of {A}
using Matrix3 = std::array<double, 9>;  ///< row-major

/// A direction as measured in one image. An image measures only the angle in its plane. `direction` is the projection
/// onto that plane; the component out of it is unknown and set to zero. The information is that of one angle, n n^T /
/// variance, with n perpendicular to the direction within the plane. This is exact at any inclination of the curve to
/// the plane if it is used as an angle about n x direction: n . h = 0 holds for every h that projects onto `direction`.
struct SeenDirection {
  Vector3 direction{};             ///< unit vector in {A}
  Matrix3 information_per_rad2{};  ///< rank 1, 1/rad^2; zero along `direction` and along the optical axis
};

/// Maps between pixels of one camera and {A}. Pixels are (u, v), u right, v down; the centre of the first pixel is (0,
/// 0).
class View {
 public:
  View() = default;
  virtual ~View() = default;

  /// Computes a point seen at a pixel.
  /// @param pixel pixel (u, v)
  /// @return point in {A}, mm; along a direction that the camera does not measure the value has no meaning, and the
  ///   information matrix is zero
  virtual Vector3 position_mm(const cv::Point2d& pixel) const = 0;
  /// Computes the pixel at which a point is seen.
  /// @param position_mm point in {A}, mm
  /// @return pixel (u, v)
  virtual cv::Point2d pixel(const Vector3& position_mm) const = 0;

  /// Computes the information of a measured pixel.
  /// @param pixel          pixel (u, v)
  /// @param covariance_px2 its covariance, px^2
  /// @return inverse covariance in {A}, 1/mm^2; zero along the optical axis
  virtual Matrix3 information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const = 0;

  /// Computes the direction of a curve at a pixel.
  /// @param pixel         pixel (u, v)
  /// @param direction_px  unit vector of the curve in the image (u, v)
  /// @param variance_rad2 variance of its angle in the image, rad^2; > 0
  /// @return direction and information in {A}
  virtual SeenDirection direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px,
                                  double variance_rad2) const = 0;

  /// @return scale of the image, px/mm
  virtual double px_per_mm() const = 0;

  /// @return the only image size for which the view is valid, px; empty if it is valid for all sizes
  virtual std::optional<cv::Size> picture_size() const { return {}; }

 protected:
  /// Copies a view; for derived classes.
  View(const View&) = default;
  /// Assigns a view; for derived classes.
  /// @return this view
  View& operator=(const View&) = default;
};

}  // namespace bevel::camera
