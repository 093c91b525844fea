// SPDX-License-Identifier: MIT
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>

namespace bevel::camera {

/// The side of the picture through which the shaft comes in. The needle is followed to within 45 degrees of the inward
/// normal of this side, which covers |gamma| < pi/4 of the model.
enum class EntrySide { top, bottom, left, right };

enum class Background {
  local,        ///< a pixel is compared with its neighbours across the needle; needs no empty picture
  first_frame,  ///< the first frame shows no needle and is subtracted from all others (gain corrected)
};

/// What of the needle is reported.
enum class TipPoint {
  axis,  ///< the shaft's axis at the depth of the foremost point: stays where it is when the needle is rotated
  seen,  ///< the end that an eye marks (end_fit.hpp): short of a point too thin to be seen, and beside the axis by up
         ///< to half the diameter, on the side to which the bevel runs out
};

/// Lengths in mm are turned into pixels by the view. "Gray" is levels of 255.
struct TrackerConfig {
  // Where the needle comes in
  EntrySide entry_side = EntrySide::top;
  cv::Point2d entry_px{-1.0, -1.0};   ///< pixel where tracking starts; negative: the middle of the entry side
  double entry_half_width_px = -1.0;  ///< how far beside entry_px the shaft may cross; negative: anywhere
  // The needle
  double needle_diameter_mm = 1.27;  ///< 18 gauge
  double bevel_length_mm = 3.49;     ///< diameter / tan(bevel angle); 20 degrees here. Zero for a blunt end
  double bevel_length_sd = 0.35;     ///< of its logarithm: needles of one gauge are ground at 10 to 30 degrees
  TipPoint tip_point = TipPoint::axis;
  double min_contrast_gray = 20.0;  ///< darker than its surroundings by at least this; fainter lines are ignored
  double min_length_mm = 6.0;       ///< shorter visible needles are reported as `too_short`
  // What is fitted
  /// Piece behind the tip which fixes direction and curvature. 25 mm gave errors of 0.15 mm where the bevel had been
  /// turned; noise is no problem at 10 mm.
  double fit_length_mm = 10.0;
  double curvature_sigma_per_mm = 0.01;  ///< curvatures expected; twice the 0.0047 / mm of the model's needle
  /// Change of curvature along that piece: 2 k where the bevel was turned over. Told less, a needle's end is taken to
  /// bend on as before the turn.
  double curvature_change_per_mm = 0.01;
  // Region of interest
  double roi_ahead_mm = 10.0;  ///< how far beyond the prediction the tip may be
  double roi_side_mm = 8.0;    ///< how far beside it
  // When to refuse
  double max_blur_mm = 0.9;         ///< standard deviation of the edge at the tip
  double saturated_fraction = 0.3;  ///< of the pixels around the tip at 255 or 0
  double second_score_ratio = 0.6;  ///< a second needle with this share of the first one's evidence is an ambiguity
  double max_along_sd_mm = 0.7;     ///< an end that is known less well is `unsure`
  int64_t max_age_us = 500'000;     ///< older frames are `late`
  // Honesty of the covariance: what no residual shows.
  double floor_across_mm = 0.005;  ///< standard deviation below which no measurement is trusted
  double floor_along_mm = 0.02;
  double floor_heading_rad = 0.003;
  double max_heading_sd_rad = 0.15;  ///< no heading that is known less well is `ok`: it would bring nothing
  Background background = Background::local;
};

/// Throws ArgumentError naming the key, the value and what is allowed.
void check(const TrackerConfig& config);

}  // namespace bevel::camera
