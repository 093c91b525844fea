// SPDX-License-Identifier: MIT
#pragma once
// From a path down a patch to the needle's end: nominal centreline, darkness and its moment along it, the model of a
// bevelled end fitted to both. Canonical coordinates of the patch (the needle runs down).
#include <opencv2/core.hpp>
#include <string_view>

#include <bevel/drivers/camera/centreline.hpp>
#include <bevel/drivers/camera/end_fit.hpp>
#include <bevel/drivers/camera/ridge_path.hpp>

namespace bevel::camera {

/// Lengths in pixels of the patch.
struct EndSettings {
  double needle_px = 6.4;  ///< diameter
  double bevel_px = 17.0;  ///< as expected
  double bevel_log_sd = 0.35;
  double fit_length_px = 50.0;
  double curvature_sigma_per_px = 0.0;
  double curvature_change_per_px = 0.0;
  double min_contrast_gray = 20.0;
};

struct NeedleEnd {
  bool found = false;
  std::string_view reason;  ///< why not; static storage
  std::string_view doubt;   ///< why what was found may not be the needle's end; empty if there is no such reason
  Centreline line;          ///< nominal
  EndFit fit;
  cv::Point2d axis_tip;  ///< on the axis, at the depth of the foremost point
  cv::Point2d seen;      ///< where an eye marks the end
  cv::Vec2d tangent;     ///< of the axis at the tip, forward
  double slope_col_per_row = 0.0;
  double lens_blur_px = 0.0;
  double contrast_gray = 0.0;
};

NeedleEnd find_end(const cv::Mat& patch, const RidgePath& path, int end_row, const RidgeScale& scale,
                   const EndSettings& settings);

}  // namespace bevel::camera
