// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Settings of the tip tracker.
#include <cstdint>
#include <opencv2/core.hpp>

namespace bevel::camera {

/// Side of the image through which the shaft enters. The needle is followed to within 45 degrees of the inward
/// normal of this side, which covers |gamma| < pi/4 of the model.
enum class EntrySide {
  top,     ///< first row
  bottom,  ///< last row
  left,    ///< first column
  right    ///< last column
};

/// Reference for the brightness of a pixel.
enum class Background {
  local,        ///< a pixel is compared with its neighbours across the needle; needs no empty picture
  first_frame,  ///< the first frame shows no needle and is subtracted from all others (gain corrected)
};

/// Point of the needle that is reported.
enum class TipPoint {
  axis,  ///< the shaft's axis at the depth of the foremost point: stationary when the needle is rotated
  /// The end that an observer would mark (end_fit.hpp): short of a point too thin to be seen, and displaced from the
  /// axis by up to half the diameter, towards the bevel's point.
  seen,
};

/// Settings of a tip tracker. Lengths in mm are converted to pixels by the view. "Gray" means levels of 255.
struct TrackerConfig {
  /// Side of the image through which the shaft enters.
  EntrySide entry_side = EntrySide::top;
  cv::Point2d entry_px{-1.0, -1.0};  ///< pixel where tracking starts; negative: the middle of the entry side
  /// Largest distance from entry_px at which the shaft may enter, px; negative: anywhere.
  double entry_half_width_px = -1.0;
  /// Diameter of the needle, mm; default 18 gauge.
  double needle_diameter_mm = 1.27;
  /// Length of the bevel, mm: diameter / tan(bevel angle); default 20 degrees. Zero for a blunt end.
  double bevel_length_mm = 3.49;
  /// Standard deviation of the logarithm of bevel_length_mm: needles of one gauge are ground at 10 to 30 degrees.
  double bevel_length_sd = 0.35;
  TipPoint tip_point = TipPoint::axis;  ///< point that is reported
  /// Least darkness relative to the surroundings, grey levels; fainter lines are ignored.
  double min_contrast_gray = 20.0;
  /// Visible needles shorter than this are reported as `too_short`, mm.
  double min_length_mm = 6.0;
  /// Length of the piece behind the tip that determines direction and curvature, mm. 25 mm gave errors of 0.15 mm where
  /// the bevel was rotated; the noise is small enough at 10 mm.
  double fit_length_mm = 10.0;
  /// Standard deviation of the curvature, 1/mm; default twice the 0.0047 / mm of the model's needle.
  double curvature_sigma_per_mm = 0.01;
  /// Standard deviation of the change of curvature along that piece, 1/mm: 2 k where the bevel was rotated by 180
  /// degrees. With a smaller value the end of the needle is assumed to bend as before the rotation.
  double curvature_change_per_mm = 0.01;
  double roi_ahead_mm = 10.0;  ///< largest distance of the tip beyond the prediction, mm
  double roi_side_mm = 8.0;    ///< largest lateral distance of the tip from the prediction, mm
  double max_blur_mm = 0.9;    ///< largest standard deviation of the edge at the tip, mm
  /// Fraction of the pixels around the tip at 255 or 0 above which the frame is `saturated`.
  double saturated_fraction = 0.3;
  /// Fraction of the first needle's evidence above which a second needle is an ambiguity.
  double second_score_ratio = 0.6;
  double max_along_sd_mm = 0.7;  ///< an end with a larger standard deviation along the needle is `unsure`, mm
  int64_t max_age_us = 500'000;  ///< older frames are `late`, us
  /// Minimum standard deviation of the tip across the needle, mm; accounts for errors that residuals do not show.
  double floor_across_mm = 0.005;
  double floor_along_mm = 0.02;      ///< minimum standard deviation of the tip along the needle, mm
  double floor_heading_rad = 0.003;  ///< minimum standard deviation of the heading, rad
  /// A heading with a larger standard deviation is not `ok`, rad; it would not improve the estimate.
  double max_heading_sd_rad = 0.15;
  Background background = Background::local;  ///< reference for the brightness
};

/// Checks the settings.
/// @param config settings
/// @throws ArgumentError naming the key, the value and what is allowed
void check(const TrackerConfig& config);

}  // namespace bevel::camera
