#pragma once
// Sub-pixel geometry of a found needle (canonical: it runs down the patch).
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/camera/ridge_path.hpp"

namespace bevel::camera {

/// Darkness-weighted centre of the needle in one row, near column `near_col`; NaN if nothing there is darker than the
/// straight line between its two sides.
double centre_in_row(const cv::Mat& patch, int row, double near_col, const RidgeScale& scale);

/// The direction of the end of a centreline. A second parabola through the same rows, with the same weights: for the
/// place of the tip the curvature's prior is held strong (residuals of 0.3 px are assumed), which draws a bent needle's
/// end straight; here it has the weight that it has against the residuals found.
struct TangentFit {
  double last_row = 0.0, scale_px = 1.0;  ///< as Centreline's
  cv::Vec3d coefficient;
  cv::Matx33d covariance;  ///< of the coefficients, from the residuals and the prior of the curvature
  /// What a unit change of curvature (i + 1/2) spacings behind the last row does to the coefficients.
  static constexpr int kBends = 4;
  std::array<cv::Vec3d, kBends> by_bend;
  double bend_spacing_px = 0.0;
  double curvature_change_per_px = 0.0;  ///< standard deviation of all those changes together

  double slope(double row) const;                ///< d col / d row
  double angle_variance_rad2(double row) const;  ///< of atan(slope(row)): noise, curvature, and its changes
};

/// col(row) as a polynomial of degree 2 around the last row: a good arc over the short piece that is fitted (the
/// cubic term of a circle of 200 mm radius over 25 mm is below 0.02 px).
struct Centreline {
  double last_row = 0.0;   ///< origin of the polynomial
  double scale_px = 1.0;   ///< rows per unit, for conditioning
  cv::Vec3d coefficient;   ///< col = c0 + c1 t + c2 t^2, t = (row - last_row) / scale_px
  cv::Matx33d covariance;  ///< of the coefficients, from the residuals
  double residual_px = 0.0;
  int rows_used = 0;
  TangentFit tangent;

  double col(double row) const;
  double slope(double row) const;                      ///< d col / d row
  double variance_px2(double row) const;               ///< of col(row)
  cv::Point2d along(double row, double arc_px) const;  ///< the point `arc_px` further down the curve than `row`
};

/// Iteratively reweighted least squares with Tukey's biweight: rows in which the centre was drawn aside by a bubble or
/// a grid line lose their vote. rows_used is 0 if fewer than 8 rows remain.
/// Lengths in px, curvatures in 1/px.
struct CentrelinePriors {
  double correlation_px = 4.0;           ///< of residuals along the rows, for the place of the tip
  double tangent_correlation_px = 2.0;   ///< the same for the tangent
  double curvature_sigma_per_px = 0.0;   ///< 0 +- this: a short piece shows none, and noise must not bend the tangent
  double curvature_change_per_px = 0.0;  ///< along the piece, +- this: what the parabola cannot follow
};
Centreline fit_centreline(const std::vector<cv::Point2d>& centres, const CentrelinePriors& priors);

/// Darkness of the needle against its two sides, averaged across its width, at the point `p` of a curve with direction
/// (slope, 1). In the units of the picture.
double darkness_across(const cv::Mat& patch, const cv::Point2d& p, double slope, const RidgeScale& scale);

/// Standard deviation of the blur across the shaft in [first_row, last_row]: the second moment of its mean dark profile
/// less that of a bar of `needle_width_px`. Grows to about three needle widths, then only says "at least".
double blur_across_px(const cv::Mat& patch, const Centreline& line, int first_row, int last_row,
                      double needle_width_px);

}  // namespace bevel::camera
