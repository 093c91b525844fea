// SPDX-License-Identifier: MIT
#pragma once
// Sub-pixel geometry of a found needle (canonical: it runs down the patch).
#include <opencv2/core.hpp>
#include <vector>

#include <bevel/drivers/camera/end_fit.hpp>
#include <bevel/drivers/camera/ridge_path.hpp>

namespace bevel::camera {

/// Darkness-weighted centre of the needle in one row, near column `near_col`; NaN if nothing there is darker than the
/// straight line between its two sides.
double centre_in_row(const cv::Mat& patch, int row, double near_col, const RidgeScale& scale);

/// col(row) as a polynomial of degree 2 around the last row: a good arc over the short piece that is fitted (the
/// cubic term of a circle of 200 mm radius over 25 mm is below 0.02 px).
struct Centreline {
  double last_row = 0.0;   ///< origin of the polynomial
  double scale_px = 1.0;   ///< rows per unit, for conditioning
  cv::Vec3d coefficient;   ///< col = c0 + c1 t + c2 t^2, t = (row - last_row) / scale_px
  cv::Matx33d covariance;  ///< of the coefficients, from the residuals
  double residual_px = 0.0;
  int rows_used = 0;

  double col(double row) const;
  double slope(double row) const;                      ///< d col / d row
  double variance_px2(double row) const;               ///< of col(row)
  cv::Point2d along(double row, double arc_px) const;  ///< the point `arc_px` further down the curve than `row`
};

/// Iteratively reweighted least squares with Tukey's biweight: rows in which the centre was drawn aside by a bubble or
/// a grid line lose their vote. rows_used is 0 if fewer than 8 rows remain.
/// Lengths in px, curvatures in 1/px.
struct CentrelinePriors {
  double correlation_px = 4.0;          ///< of residuals along the rows
  double curvature_sigma_per_px = 0.0;  ///< 0 +- this: a short piece shows none, and noise must not bend the line
};
Centreline fit_centreline(const std::vector<cv::Point2d>& centres, const CentrelinePriors& priors);

/// Darkness against the straight line between the two sides, summed across the needle as far as `reach_px` to each side
/// of the line, and its first moment, at every pixel of arc length from `from_px` to `to_px` past `row`; as much of
/// that as lies in the patch.
EndProfile profile_along(const cv::Mat& patch, const Centreline& line, double row, int from_px, int to_px, int reach_px,
                         const RidgeScale& scale);

/// Mean darkness at every pixel as far as `reach_px` to each side of what lies `across_px` right of the line, over
/// [from_px, to_px] of arc length past `row`.
std::vector<double> mean_dark_across(const cv::Mat& patch, const Centreline& line, double row, double from_px,
                                     double to_px, double across_px, int reach_px, const RidgeScale& scale);

/// Standard deviation of the blur across the shaft in [first_row, last_row]: that of a bar of `needle_width_px` which
/// fits its mean profile best, with what lies beside it left out. At most one and a half needle widths, then "at
/// least".
double blur_across_px(const cv::Mat& patch, const Centreline& line, int first_row, int last_row,
                      double needle_width_px);

}  // namespace bevel::camera
