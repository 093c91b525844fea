// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// From a path down a patch to the needle's end: nominal centreline, darkness and its moments along it, and the model
/// of a bevelled end fitted to them. Canonical coordinates of the patch (the needle runs down).
#include <opencv2/core.hpp>
#include <string_view>

#include <bevel/drivers/camera/centreline.hpp>
#include <bevel/drivers/camera/end_fit.hpp>
#include <bevel/drivers/camera/ridge_path.hpp>

namespace bevel::camera {

/// Settings. Lengths in pixels of the patch.
struct EndSettings {
  double needle_px = 6.4;                ///< diameter of the needle
  double bevel_px = 17.0;                ///< expected length of the bevel
  double bevel_log_sd = 0.35;            ///< standard deviation of its logarithm
  double fit_length_px = 50.0;           ///< length of the piece behind the tip that is fitted
  double curvature_sigma_per_px = 0.0;   ///< standard deviation of the curvature, 1/px
  double curvature_change_per_px = 0.0;  ///< standard deviation of its change along the piece, 1/px
  double min_contrast_gray = 20.0;       ///< least darkness relative to the surroundings, grey levels
};

/// End of a needle.
struct NeedleEnd {
  bool found = false;              ///< an end was found
  std::string_view reason;         ///< why none was found; static storage
  std::string_view doubt;          ///< why the result may not be the needle's end; empty if there is no such reason
  Centreline line;                 ///< nominal centreline
  EndFit fit;                      ///< fit of the end
  cv::Point2d axis_tip;            ///< on the axis, at the depth of the foremost point
  cv::Point2d seen;                ///< where an observer would mark the end
  cv::Vec2d tangent;               ///< unit vector of the axis at the tip, forward
  double slope_col_per_row = 0.0;  ///< slope of the axis at the tip, columns per row
  double lens_blur_px = 0.0;       ///< standard deviation of the lens blur, px
  double contrast_gray = 0.0;      ///< darkness of the shaft relative to the surroundings, grey levels
};

/// Finds the end of a needle.
/// @param patch    brightness, CV_8UC1
/// @param path     path along the needle
/// @param end_row  last row of the needle (end_of_needle())
/// @param scale    widths
/// @param settings settings
/// @return end
NeedleEnd find_end(const cv::Mat& patch, const RidgePath& path, int end_row, const RidgeScale& scale,
                   const EndSettings& settings);

}  // namespace bevel::camera
