// SPDX-License-Identifier: MIT
#pragma once
// A camera whose lens, pose and wall are known (calibration/camera_model.hpp), behind the same port as PlanarView.
// Pixels are undistorted, never pictures.
//
// What one camera says of a point is a ray: in the gel, after Snell, where there is a wall. As a measurement of
// the tip it is a point on that ray and an information matrix of rank 2 with nothing along the ray. The point is where
// the ray meets the NEEDLE PLANE: the plane through the z axis of {A} that is squarest to the camera's line of sight.
// It runs smoothly with the pixel, is what PlanarView gives for a camera square to an axis, and is near the needle,
// which goes in along z. Where on the ray it stands carries no information, and the estimator takes none.
//
// The information is that of the pixel carried to this point: a tip that stands beside the plane, at the distance D (1
// + e) from the camera instead of D, is known by 1 + e less well than it says (10 mm at 250 mm: 4 %).
#include <bevel/drivers/camera/calibration/camera_model.hpp>
#include <bevel/drivers/camera/view.hpp>

namespace bevel::camera {

class CalibratedView : public View {
 public:
  /// Throws ArgumentError naming the camera, the key, the value and what is allowed: also of a camera that
  /// looks along the needle, within 20 degrees of z of {A}, or that does not see its own picture's middle.
  explicit CalibratedView(const CameraModel& model);

  /// NaN where the lens has no inverse, and where the ray does not meet the needle plane.
  Vector3 position_mm(const cv::Point2d& pixel) const override;
  /// NaN where the camera cannot see the point: behind it, or before the wall.
  cv::Point2d pixel(const Vector3& position_mm) const override;
  Matrix3 information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const override;
  /// The projection of the curve onto the plane across the ray, and one angle in it.
  SeenDirection direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px, double variance_rad2) const override;
  /// On the needle plane, at the picture's middle.
  double px_per_mm() const override { return px_per_mm_; }
  std::optional<cv::Size> picture_size() const override { return model_.lens.picture_px; }

  const CameraModel& model() const { return model_; }
  /// Unit normal of the needle plane, toward the scene.
  const cv::Vec3d& plane_normal() const { return plane_normal_; }

 private:
  struct Spot {  // what a pixel sees
    cv::Vec3d point_mm;
    cv::Vec3d ray, right, down;  // unit vectors; right and down span the plane across the ray
    cv::Matx22d mm_per_px;       // along right, down; by u, v
  };
  std::optional<Spot> spot(const cv::Point2d& pixel) const;
  std::optional<cv::Vec3d> on_plane(const Ray& ray) const;

  CameraModel model_;
  cv::Vec3d plane_normal_;
  double px_per_mm_ = 1.0;
};

}  // namespace bevel::camera
