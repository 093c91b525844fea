// SPDX-License-Identifier: MIT
#pragma once
// Where a bevelled needle ends, along and across its own axis, from what is dark around its centreline: at the arc
// length s along a nominal line, darkness m0 summed across the needle and its first moment m1 about that line. The
// needle's axis lies c(s) = c0 + c1 t + c2 t^2 beside the nominal line, and the model (bevel_shape.hpp; x = tip - s) is
//   m0(s) = base + height (outline.share(x) - pale face.share(x))
//   m1(s) = height [ c(s) (outline.share - pale face.share) + radius (outline.moment - pale face.moment) ]
// and likewise m2, the sum weighted by spread_weight(), which tells a needle from a shade that is wider than one;
// blurred by the lens as it is measured across the shaft. The moments of a cut that runs out to one side are what tells
// the axis from the middle of what is seen there; neither is offset by a constant.
#include <array>
#include <span>
#include <vector>

namespace bevel::camera {

struct EndProfile {
  double first_s_px = 0.0;     ///< evenly spaced by one pixel from here
  std::vector<double> dark;    ///< gray px
  std::vector<double> moment;  ///< gray px^2
  std::vector<double> spread;  ///< gray px; weighted by spread_weight() across, which a wide shade has none of
  std::vector<double> beside;  ///< gray, mean of both sides
};

/// Weight of darkness at `off_px` beside the line in a profile summed over `window_px` to each side: the second
/// Legendre polynomial, so that white noise is as large as in the plain sum and independent of it.
inline double spread_weight(double off_px, double window_px) {
  const double x = off_px / window_px;
  return 2.2360679774997896 * (1.5 * x * x - 0.5);
}

/// What is known beforehand. Lengths in px, standard deviations beside their means.
struct EndPriors {
  double radius_px = 3.0;
  double blur_px = 1.0;
  double height = 500.0;  ///< darkness of the shaft, gray px; +- 20 %
  double bevel_px = 17.0;
  double bevel_log_sd = 0.35;  ///< needles of one gauge are ground at 10 to 30 degrees
  double curvature_sigma_per_px = 0.0;
  double curvature_change_per_px = 0.0;  ///< along the piece; what the parabola cannot follow
  double window_px = 8.0;                ///< half the width over which the moments are summed
};

/// A point found: arc length along the nominal line, and offset from it to the right of s.
struct EndPoint {
  double s_px = 0.0;
  double s_variance_px2 = 0.0;  ///< including other ends that the same picture allows
  double across_px = 0.0;
  double across_variance_px2 = 0.0;
};

/// Where an eye marks the end: darkness has fallen to this share of the shaft's, and fainter than that it is lost in
/// the background. The labels of tests/camera/real_tips.csv lie there on average.
inline constexpr double kSeenShare = 1.0 / 6.0;

struct EndFit {
  bool converged = false;
  EndPoint tip;        ///< on the axis, at the depth of the foremost point
  EndPoint seen;       ///< where kSeenShare is left, in the middle of what is dark over the last needle's width
  double slope = 0.0;  ///< d across / d s of the axis at the tip
  double slope_variance = 0.0;
  double height = 0.0, base = 0.0;
  double bevel_px = 0.0;
  double roll_rad = 0.0;
  double pale = 0.0;
  double residual = 0.0;        ///< root mean square, over height
  double correlation_px = 1.0;  ///< over how many samples residuals are alike
};

EndFit fit_end(const EndProfile& profile, const EndPriors& priors);

}  // namespace bevel::camera
