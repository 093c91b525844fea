// SPDX-License-Identifier: MIT
#pragma once
// Port: what a pixel of one camera says about a point of {A} (mm; origin at the entry point, z into the tissue).
#include <array>
#include <opencv2/core.hpp>
#include <optional>

namespace bevel::camera {

using Vector3 = std::array<double, 3>;  ///< along x, y, z of {A}
using Matrix3 = std::array<double, 9>;  ///< row-major

/// A direction as one picture shows it. A picture knows the angle in its plane alone: `direction` is the projection
/// onto that plane, the part out of it being unknown and left zero, and the information is that of one angle, n n^T /
/// variance with n across the direction within the plane. That is exact however far the curve points out of the plane,
/// for who compares it as an angle about n x direction: n . h = 0 holds for every h that projects onto `direction`.
struct SeenDirection {
  Vector3 direction{};             ///< unit vector in {A}
  Matrix3 information_per_rad2{};  ///< rank 1; zero along `direction` and along the optical axis
};

class View {
 public:
  View() = default;
  virtual ~View() = default;

  /// Point of {A} in mm seen at `pixel` (u right, v down; the centre of the first pixel is 0, 0). Along an axis
  /// which the camera cannot see the value means nothing; the information matrix says so.
  virtual Vector3 position_mm(const cv::Point2d& pixel) const = 0;
  virtual cv::Point2d pixel(const Vector3& position_mm) const = 0;

  /// Inverse covariance in {A}, 1/mm^2, of a pixel with the 2x2 covariance `covariance_px2`; zero along the optical
  /// axis.
  virtual Matrix3 information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const = 0;

  /// What a curve through `pixel` says that runs along the unit vector `direction_px` (u, v), known to a variance of
  /// its angle in the picture of `variance_rad2`, above 0.
  virtual SeenDirection direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px,
                                  double variance_rad2) const = 0;

  virtual double px_per_mm() const = 0;

  /// The one size of picture for which the view holds; nothing if it holds for all.
  virtual std::optional<cv::Size> picture_size() const { return {}; }

 protected:
  View(const View&) = default;
  View& operator=(const View&) = default;
};

}  // namespace bevel::camera
