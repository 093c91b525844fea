// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// View of a camera with known lens, pose and wall (calibration/camera_model.hpp). Pixels are undistorted, images are
/// not.
///
/// A pixel of one camera determines a ray; with a wall, the ray in the gel after refraction (Snell). The measurement of
/// the tip is a point on that ray, with an information matrix of rank 2 that is zero along the ray. The point is the
/// intersection of the ray with the NEEDLE PLANE: the plane through the z axis of {A} that is closest to perpendicular
/// to the camera's line of sight. The point varies smoothly with the pixel, equals that of PlanarView for a camera
/// perpendicular to an axis, and is close to the needle, which is inserted along z. Its position along the ray carries
/// no information, and the estimator uses none.
///
/// The information is that of the pixel at this point. For a tip outside the plane, at the distance D (1 + e) from the
/// camera instead of D, the true standard deviation is larger than stated by the factor 1 + e (10 mm at 250 mm: 4 %).
#include <bevel/drivers/camera/calibration/camera_model.hpp>
#include <bevel/drivers/camera/view.hpp>

namespace bevel::camera {

/// View of a calibrated camera.
class CalibratedView : public View {
 public:
  /// Creates a view.
  /// @param model calibrated camera
  /// @throws ArgumentError naming the camera, the key, the value and what is allowed; also for a camera that looks
  /// along the
  ///   needle, within 20 degrees of z of {A}, or that does not see the middle of its image
  explicit CalibratedView(const CameraModel& model);

  /// Computes the intersection of the pixel's ray with the needle plane.
  /// @param pixel pixel (u, v)
  /// @return point in {A}, mm; NaN if the lens model has no inverse there, or if the ray does not meet the needle plane
  Vector3 position_mm(const cv::Point2d& pixel) const override;
  /// Computes the pixel at which a point is seen.
  /// @param position_mm point in {A}, mm
  /// @return pixel (u, v); NaN if the camera cannot see the point: behind the camera, or in front of the wall
  cv::Point2d pixel(const Vector3& position_mm) const override;
  Matrix3 information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const override;
  /// Computes the projection of the curve onto the plane perpendicular to the ray, and its angle in that plane.
  /// @param pixel         pixel (u, v)
  /// @param direction_px  unit vector of the curve in the image (u, v)
  /// @param variance_rad2 variance of its angle in the image, rad^2; > 0
  /// @return direction and information in {A}
  SeenDirection direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px, double variance_rad2) const override;
  /// @return scale on the needle plane at the middle of the image, px/mm
  double px_per_mm() const override { return px_per_mm_; }
  std::optional<cv::Size> picture_size() const override { return model_.lens.picture_px; }

  /// @return calibrated camera
  const CameraModel& model() const { return model_; }
  /// @return unit normal of the needle plane in {A}, towards the scene
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
