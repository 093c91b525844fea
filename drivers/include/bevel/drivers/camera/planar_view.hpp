// SPDX-License-Identifier: MIT
#pragma once
// A rectified picture of one plane: every pixel is the same number of mm, and each picture axis lies along an axis of
// {A}. It holds for a camera that looks squarely at the plane in which the needle bends, and for pictures rectified
// beforehand; no lens, no refraction.
#include <bevel/drivers/camera/view.hpp>

namespace bevel::camera {

enum class WorldAxis { x = 0, y = 1, z = 2 };

/// Which axis of {A} a picture axis carries, and which way: sign +1 if the coordinate grows with the pixel.
struct SignedAxis {
  WorldAxis axis = WorldAxis::z;
  int sign = 1;
};

struct PlanarViewConfig {
  double px_per_mm = 5.0;
  cv::Point2d origin_px{0.0, 0.0};     ///< pixel (u, v) of the origin of {A}, the entry point; may lie outside
  SignedAxis u_axis{WorldAxis::y, 1};  ///< carried by columns, left to right
  SignedAxis v_axis{WorldAxis::z, 1};  ///< carried by rows, top to bottom
};

class PlanarView : public View {
 public:
  /// Throws ArgumentError naming the key, the value and what is allowed.
  explicit PlanarView(const PlanarViewConfig& config);

  Vector3 position_mm(const cv::Point2d& pixel) const override;
  cv::Point2d pixel(const Vector3& position_mm) const override;
  Matrix3 information_per_mm2(const cv::Point2d& pixel, const cv::Matx22d& covariance_px2) const override;
  SeenDirection direction(const cv::Point2d& pixel, const cv::Vec2d& direction_px, double variance_rad2) const override;
  double px_per_mm() const override { return config_.px_per_mm; }
  const PlanarViewConfig& config() const { return config_; }

 private:
  PlanarViewConfig config_;
};

}  // namespace bevel::camera
