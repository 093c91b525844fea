// SPDX-License-Identifier: MIT
#pragma once
// What lies between a plane that is seen squarely and its picture: a lens that is not perfect, and light that bends
// where it leaves the gel. Both move a point along its radius from the optical axis, which stands at the picture's
// middle.
#include <opencv2/core.hpp>

namespace bevel::rig {

struct LensDistortion {
  double k1 = 0.0, k2 = 0.0;  ///< r_seen = r (1 + k1 q^2 + k2 q^4), q = r over half the picture's diagonal (Brown 1966)
};

/// A camera before a flat wall of gel. Snell at the wall: r = D tan(a) + d tan(b), sin(a) = n sin(b); what is seen at
/// the angle a lies at tan(a) (D + d / n) of a picture whose scale is right at its middle.
struct FlatRefraction {
  double gel_depth_mm = 0.0;   ///< d, from the wall to the needle; 0 switches it off
  double distance_mm = 250.0;  ///< D, from the camera to the wall
  double index = 1.33;         ///< n of the gel over that of air
};

class Optics {
 public:
  /// Throws ArgumentError naming the key, the value and what is allowed.
  Optics(const LensDistortion& lens, const FlatRefraction& refraction, cv::Size picture_px, double px_per_mm);
  bool trivial() const { return trivial_; }
  /// Where a point is seen that an ideal camera would see at `p`; px.
  cv::Point2d seen(const cv::Point2d& p) const;
  /// `ideal` as it is seen, of the same size.
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
