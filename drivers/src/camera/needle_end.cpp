// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/needle_end.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <bevel/drivers/camera/line_location.hpp>

namespace bevel::camera {
namespace {

Centreline nominal_line(const cv::Mat& patch, const RidgePath& path, int end_row, const RidgeScale& scale,
                        const EndSettings& settings) {
  const int last_shaft_row = end_row - cvRound(0.5 * settings.bevel_px) - scale.core_px;
  const int first_row = std::max(0, end_row - cvRound(settings.fit_length_px));
  std::vector<cv::Point2d> centres;
  for (int r = first_row; r <= last_shaft_row; ++r) {
    const double col = centre_in_row(patch, r, path.cols[static_cast<size_t>(r)], scale);
    if (std::isfinite(col)) centres.emplace_back(col, r);
  }
  return fit_centreline(centres, {4.0, settings.curvature_sigma_per_px});
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Largest step in the light beside the needle within one needle's width of `at_s`, gray.
double step_beside(const EndProfile& profile, double at_s, double width_px) {
  const int width = std::max(3, cvRound(width_px));
  const int count = static_cast<int>(profile.beside.size());
  const int middle = cvRound(at_s - profile.first_s_px);
  double largest = 0.0;
  for (int cut = middle - width; cut <= middle + width; ++cut) {
    if (cut - width < 0 || cut + width >= count) continue;
    const auto here = profile.beside.begin() + cut;
    const double before = std::accumulate(here - width, here, 0.0);
    const double after = std::accumulate(here + 1, here + 1 + width, 0.0);
    largest = std::max(largest, std::abs(after - before) / width);
  }
  return largest;
}

}  // namespace

NeedleEnd find_end(const cv::Mat& patch, const RidgePath& path, int end_row, const RidgeScale& scale,
                   const EndSettings& settings) {
  NeedleEnd end;
  end.reason = "no steady centreline";
  end.line = nominal_line(patch, path, end_row, scale, settings);
  if (end.line.rows_used == 0) return end;

  end.reason = "the end of the needle is not seen";
  const int back_px = std::min(cvRound(settings.fit_length_px), end_row);
  const int ahead_px = cvRound(1.2 * settings.bevel_px) + 3 * scale.core_px;
  const int last_shaft_row = end_row - cvRound(0.5 * settings.bevel_px) - scale.core_px;
  const int blur_rows = std::min(60, end.line.rows_used);
  end.lens_blur_px = blur_across_px(patch, end.line, last_shaft_row - blur_rows, last_shaft_row, settings.needle_px);
  const double radius_px = 0.5 * settings.needle_px;
  // All that the lens has spread, and no more of the background than that.
  const int reach_px = std::min(scale.offset_px - 2, cvCeil(radius_px + 2.5 * end.lens_blur_px));
  const EndProfile profile = profile_along(patch, end.line, end_row, -back_px, ahead_px, reach_px, scale);
  if (profile.dark.size() < 20) return end;
  const double seen_ahead_px = profile.first_s_px + static_cast<double>(profile.dark.size()) - 1.0;
  if (seen_ahead_px < 0.5 * settings.bevel_px + 2.0) return end;
  std::vector<double> shaft;
  for (size_t i = 0; i < profile.dark.size(); ++i)
    if (profile.first_s_px + static_cast<double>(i) < -settings.bevel_px || i < 8) shaft.push_back(profile.dark[i]);
  EndPriors priors;
  priors.radius_px = radius_px;
  priors.blur_px = std::clamp(end.lens_blur_px, 0.4, settings.needle_px);
  priors.height = median_of(shaft);
  priors.bevel_log_sd = settings.bevel_log_sd;
  priors.bevel_px = std::max(settings.bevel_px, 0.5);
  priors.curvature_sigma_per_px = settings.curvature_sigma_per_px;
  priors.curvature_change_per_px = settings.curvature_change_per_px;
  priors.window_px = reach_px + 0.5;
  end.contrast_gray = priors.height / settings.needle_px;
  if (end.contrast_gray < 0.4 * settings.min_contrast_gray) return end;
  end.fit = fit_end(profile, priors);
  if (!end.fit.converged) return end;
  end.contrast_gray = end.fit.height / settings.needle_px;

  // An eye follows the dark line to its end. There it is thinner than the lens's blur, and what lies beside it is not
  // it.
  const LineLocation thin =
      locate_line(mean_dark_across(patch, end.line, end_row, end.fit.seen.s_px - settings.needle_px, end.fit.seen.s_px,
                                   end.fit.seen.across_px, scale.offset_px, scale),
                  priors.blur_px, radius_px);
  if (thin.found) {
    end.fit.seen.across_px += thin.offset_px;
    end.fit.seen.across_variance_px2 = thin.variance_px2;
  }

  const auto place = [&](const EndPoint& point) {
    const cv::Point2d on_line = end.line.along(end_row, point.s_px);
    const double slope = end.line.slope(on_line.y);
    return on_line + point.across_px / std::hypot(1.0, slope) * cv::Point2d(1.0, -slope);
  };
  end.axis_tip = place(end.fit.tip);
  end.seen = place(end.fit.seen);
  const double angle_rad = std::atan(end.line.slope(end.axis_tip.y)) + std::atan(end.fit.slope);
  end.tangent = {std::sin(angle_rad), std::cos(angle_rad)};
  end.slope_col_per_row = std::tan(angle_rad);
  end.found = true;
  end.reason = {};
  // Something that stands before the needle ends it more bluntly than its bevel does, and is seen beside it too.
  constexpr double hardly = 2.0;  // standard deviations
  const double shorter = std::log(priors.bevel_px / end.fit.bevel_px) / settings.bevel_log_sd;
  if (settings.bevel_px > 1.0 && shorter > hardly)
    end.doubt = "it ends more bluntly than its bevel: something may hide it";
  constexpr double much = 0.25;  // of the needle's own contrast
  if (step_beside(profile, end.fit.tip.s_px, settings.needle_px) > much * end.contrast_gray)
    end.doubt = "it ends at an edge of what it is seen against";
  return end;
}

}  // namespace bevel::camera
