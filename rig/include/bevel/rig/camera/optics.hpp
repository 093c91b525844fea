// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Optics between a plane parallel to the image and its image: lens distortion, and refraction where light leaves the
/// gel. Both move a point along its radius from the optical axis, which is at the middle of the image.
#include <opencv2/core.hpp>

namespace bevel::rig {

/// Radial lens distortion (Brown 1966): r_seen = r (1 + k1 q^2 + k2 q^4), with q = r over half the diagonal of the
/// image.
struct LensDistortion {
  double k1 = 0.0,  ///< coefficient of q^2
      k2 = 0.0;     ///< coefficient of q^4
};

/// Refraction of a camera in front of a flat wall of gel. Snell's law at the wall: r = D tan(a) + d tan(b), sin(a) = n
/// sin(b). A point seen at the angle a appears at tan(a) (D + d / n) in an image whose scale is right at its middle.
struct FlatRefraction {
  double gel_depth_mm = 0.0;   ///< d, from the wall to the needle, mm; 0 switches refraction off
  double distance_mm = 250.0;  ///< D, from the camera to the wall, mm
  double index = 1.33;         ///< n, refractive index of the gel relative to air
};

/// Maps ideal points and images to their distorted and refracted positions.
class Optics {
 public:
  /// Creates the mapping.
  /// @param lens       lens distortion
  /// @param refraction refraction
  /// @param picture_px size of the images, px
  /// @param px_per_mm  scale at the middle of the image, px/mm
  /// @throws ArgumentError naming the key, the value and what is allowed
  Optics(const LensDistortion& lens, const FlatRefraction& refraction, cv::Size picture_px, double px_per_mm);
  /// @return true if the mapping is the identity
  bool trivial() const { return trivial_; }
  /// Maps a point.
  /// @param p pixel at which an ideal camera would see the point
  /// @return pixel at which it is seen
  cv::Point2d seen(const cv::Point2d& p) const;
  /// Maps an image.
  /// @param ideal image of an ideal camera
  /// @return image of the same size
  cv::Mat seen(const cv::Mat& ideal) const;

 private:
  double seen_radius_px(double radius_px) const;

  LensDistortion lens_;
  FlatRefraction refraction_;
  cv::Point2d middle_;
  double half_diagonal_px_;
  double px_per_mm_;
  bool trivial_;
  cv::Mat map_;  // CV_32FC2: where each seen pixel lies in the ideal picture
};

}  // namespace bevel::rig
