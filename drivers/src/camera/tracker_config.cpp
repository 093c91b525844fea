// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/tracker_config.hpp>

#include <cmath>
#include <string>

#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

struct Range {
  const char* key;
  double value;
  double low;
  double high;
};

}  // namespace

void check(const TrackerConfig& c) {
  const Range ranges[] = {
      {"entry_px.u", c.entry_px.x, -1.0, 1e4},
      {"entry_px.v", c.entry_px.y, -1.0, 1e4},
      {"entry_half_width_px", c.entry_half_width_px, -1.0, 1e4},
      {"needle_diameter_mm", c.needle_diameter_mm, 0.05, 20.0},
      {"bevel_length_mm", c.bevel_length_mm, 0.0, 50.0},
      {"bevel_length_sd", c.bevel_length_sd, 0.01, 2.0},
      {"min_contrast_gray", c.min_contrast_gray, 2.0, 250.0},
      {"min_length_mm", c.min_length_mm, 1.0, 200.0},
      {"fit_length_mm", c.fit_length_mm, 3.0, 200.0},
      {"curvature_sigma_per_mm", c.curvature_sigma_per_mm, 1e-6, 1.0},
      {"curvature_change_per_mm", c.curvature_change_per_mm, 0.0, 1.0},
      {"roi_ahead_mm", c.roi_ahead_mm, 1.0, 200.0},
      {"roi_side_mm", c.roi_side_mm, 1.0, 200.0},
      {"max_blur_mm", c.max_blur_mm, 0.01, 50.0},
      {"saturated_fraction", c.saturated_fraction, 0.0, 1.0},
      {"second_score_ratio", c.second_score_ratio, 0.0, 1.0},
      {"max_age_us", static_cast<double>(c.max_age_us), 1.0, 60e6},
      {"max_along_sd_mm", c.max_along_sd_mm, 1e-3, 50.0},
      {"floor_across_mm", c.floor_across_mm, 1e-4, 10.0},
      {"floor_along_mm", c.floor_along_mm, 1e-4, 10.0},
      {"floor_heading_rad", c.floor_heading_rad, 1e-5, 1.0},
      {"max_heading_sd_rad", c.max_heading_sd_rad, 1e-3, 1.0},
  };
  for (const Range& r : ranges)
    if (!std::isfinite(r.value) || r.value < r.low || r.value > r.high)
      throw ArgumentError(std::string("tracker ") + r.key + " is " + std::to_string(r.value) +
                          ", allowed: " + std::to_string(r.low) + " to " + std::to_string(r.high));
  if (c.fit_length_mm <= c.bevel_length_mm)
    throw ArgumentError("tracker fit_length_mm is " + std::to_string(c.fit_length_mm) +
                        ", allowed: more than bevel_length_mm, " + std::to_string(c.bevel_length_mm));
}

}  // namespace bevel::camera
