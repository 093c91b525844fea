// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Sub-pixel geometry of a detected needle in canonical orientation (it runs down the patch).
#include <opencv2/core.hpp>
#include <vector>

#include <bevel/drivers/camera/end_fit.hpp>
#include <bevel/drivers/camera/ridge_path.hpp>

namespace bevel::camera {

/// Computes the darkness-weighted centre of the needle in one row.
/// @param patch    brightness, CV_8UC1
/// @param row      row
/// @param near_col column near the needle
/// @param scale    widths
/// @return column; NaN if no pixel is darker than the straight line between the two sides
double centre_in_row(const cv::Mat& patch, int row, double near_col, const RidgeScale& scale);

/// col(row) as a polynomial of degree 2 around the last row, which approximates an arc over the short piece that is
/// fitted (the cubic term of a circle of 200 mm radius over 25 mm is below 0.02 px).
struct Centreline {
  double last_row = 0.0;     ///< origin of the polynomial
  double scale_px = 1.0;     ///< rows per unit, for conditioning
  cv::Vec3d coefficient;     ///< col = c0 + c1 t + c2 t^2, t = (row - last_row) / scale_px
  cv::Matx33d covariance;    ///< of the coefficients, from the residuals
  double residual_px = 0.0;  ///< standard deviation of the residuals, px
  int rows_used = 0;         ///< number of rows in the fit

  /// Evaluates the polynomial.
  /// @param row row
  /// @return column
  double col(double row) const;
  /// Evaluates the derivative.
  /// @param row row
  /// @return d col / d row
  double slope(double row) const;
  /// Computes the variance of col(row).
  /// @param row row
  /// @return variance, px^2
  double variance_px2(double row) const;
  /// Computes a point at an arc length along the curve.
  /// @param row    row of the start
  /// @param arc_px arc length from there down the curve, px
  /// @return point (col, row)
  cv::Point2d along(double row, double arc_px) const;
};

/// Prior knowledge of a centreline. Lengths in px, curvatures in 1/px.
struct CentrelinePriors {
  double correlation_px = 4.0;  ///< correlation length of the residuals along the rows
  /// Prior standard deviation of the curvature around 0: a short piece does not determine the curvature, and noise must
  /// not bend the line.
  double curvature_sigma_per_px = 0.0;
};
/// Fits a centreline by iteratively reweighted least squares with Tukey's biweight, which rejects rows whose centre is
/// displaced by a bubble or a grid line.
/// @param centres centre in each row, (col, row), px
/// @param priors  prior knowledge
/// @return centreline; rows_used is 0 if fewer than 8 rows remain
Centreline fit_centreline(const std::vector<cv::Point2d>& centres, const CentrelinePriors& priors);

/// Computes the profile of darkness along a centreline: darkness relative to the straight line between the two sides,
/// summed across the needle, and its moments, at each pixel of arc length as far as the patch extends.
/// @param patch    brightness, CV_8UC1
/// @param line     centreline
/// @param row      row from which the arc length counts
/// @param from_px  first arc length past `row`, px
/// @param to_px    last arc length past `row`, px
/// @param reach_px largest distance from the line in the sum, px
/// @param scale    widths
/// @return profile
EndProfile profile_along(const cv::Mat& patch, const Centreline& line, double row, int from_px, int to_px, int reach_px,
                         const RidgeScale& scale);

/// Computes the mean darkness across the needle over an interval of arc length.
/// @param patch     brightness, CV_8UC1
/// @param line      centreline
/// @param row       row from which the arc length counts
/// @param from_px   first arc length past `row`, px
/// @param to_px     last arc length past `row`, px
/// @param across_px offset of the middle of the profile to the right of the line, px
/// @param reach_px  largest distance from the middle, px
/// @param scale     widths
/// @return darkness at each pixel from -reach_px to reach_px, grey levels
std::vector<double> mean_dark_across(const cv::Mat& patch, const Centreline& line, double row, double from_px,
                                     double to_px, double across_px, int reach_px, const RidgeScale& scale);

/// Computes the standard deviation of the blur across the shaft: that of the bar of the needle's width that fits its
/// mean profile best, without the surroundings. The result is at most one and a half needle widths, which then is a
/// lower bound.
/// @param patch           brightness, CV_8UC1
/// @param line            centreline
/// @param first_row       first row of the profile
/// @param last_row        last row of the profile
/// @param needle_width_px diameter of the needle, px
/// @return standard deviation, px
double blur_across_px(const cv::Mat& patch, const Centreline& line, int first_row, int last_row,
                      double needle_width_px);

}  // namespace bevel::camera
