// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Fit of a bevelled needle's end, along and across its axis, to the darkness around its centreline: at the arc
/// length s along a nominal line, the darkness m0 summed across the needle and its first moment m1 about that line. The
/// needle's axis has the offset c(s) = c0 + c1 t + c2 t^2 from the nominal line. Model (bevel_shape.hpp; x = tip - s):
///   m0(s) = base + height (outline.share(x) - pale face.share(x))
///   m1(s) = height [ c(s) (outline.share - pale face.share) + radius (outline.moment - pale face.moment) ]
/// and likewise m2, the sum weighted by spread_weight(), which distinguishes a needle from a wider shade. All are
/// blurred by the lens blur measured across the shaft. The moments of a cut that runs out to one side distinguish the
/// axis from the middle of the visible part; neither is offset by a constant.
#include <array>
#include <span>
#include <vector>

namespace bevel::camera {

/// Profile of darkness along a nominal line.
struct EndProfile {
  double first_s_px = 0.0;     ///< arc length of the first sample, px; the spacing is one pixel
  std::vector<double> dark;    ///< m0, grey levels times px
  std::vector<double> moment;  ///< m1, grey levels times px^2
  std::vector<double> spread;  ///< m2, grey levels times px; zero for a wide shade
  std::vector<double> beside;  ///< brightness, grey levels, mean of both sides
};

/// Computes the weight of the darkness at a distance from the line in m2: the second Legendre polynomial, so that white
/// noise is as large as in the plain sum and independent of it.
/// @param off_px    distance from the line, px
/// @param window_px half width of the sum, px
/// @return weight
inline double spread_weight(double off_px, double window_px) {
  const double x = off_px / window_px;
  return 2.2360679774997896 * (1.5 * x * x - 0.5);
}

/// Prior knowledge of the end. Lengths in px.
struct EndPriors {
  double radius_px = 3.0;  ///< radius of the needle
  double blur_px = 1.0;    ///< standard deviation of the lens blur
  double height = 500.0;   ///< darkness of the shaft, grey levels times px; +- 20 %
  double bevel_px = 17.0;  ///< length of the bevel
  /// Standard deviation of its logarithm: needles of one gauge are ground at 10 to 30 degrees.
  double bevel_log_sd = 0.35;
  double curvature_sigma_per_px = 0.0;   ///< standard deviation of the curvature, 1/px
  double curvature_change_per_px = 0.0;  ///< standard deviation of its change along the piece, 1/px
  double window_px = 8.0;                ///< half the width over which the moments are summed
};

/// A point relative to the nominal line.
struct EndPoint {
  double s_px = 0.0;            ///< arc length along the nominal line, px
  double s_variance_px2 = 0.0;  ///< variance of s_px, px^2, including other ends that are consistent with the image
  double across_px = 0.0;       ///< offset from the line to the right of s, px
  double across_variance_px2 = 0.0;  ///< variance of across_px, px^2
};

/// Fraction of the shaft's darkness at which an observer would mark the end; fainter parts are lost in the background.
/// The labels of tests/camera/real_tips.csv lie there on average.
inline constexpr double kSeenShare = 1.0 / 6.0;

/// Result of the fit.
struct EndFit {
  bool converged = false;       ///< the fit converged; the other members are valid
  EndPoint tip;                 ///< on the axis, at the depth of the foremost point
  EndPoint seen;                ///< where kSeenShare is left, in the middle of the dark part over the last needle width
  double slope = 0.0;           ///< d across / d s of the axis at the tip
  double slope_variance = 0.0;  ///< variance of the slope
  double height = 0.0,          ///< darkness of the shaft, grey levels times px
      base = 0.0;               ///< offset of the darkness, grey levels times px
  double bevel_px = 0.0;        ///< length of the bevel, px
  double roll_rad = 0.0;        ///< roll of the bevel as the image shows it, rad
  double pale = 0.0;            ///< fraction of the wall's darkness that the face of the cut lacks
  double residual = 0.0;        ///< root mean square of the residuals relative to the height
  double correlation_px = 1.0;  ///< correlation length of the residuals, px
};

/// Fits the end.
/// @param profile profile around the end, at least 16 samples
/// @param priors  prior knowledge
/// @return result; not converged if a precondition is violated
EndFit fit_end(const EndProfile& profile, const EndPriors& priors);

}  // namespace bevel::camera
