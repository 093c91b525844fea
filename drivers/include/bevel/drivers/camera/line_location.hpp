// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Lateral position of the last, thinnest part of a needle: least squares of a line that is thinner than the lens's
/// blur.
#include <vector>

namespace bevel::camera {

/// Lateral position of a line; offsets in px from the middle of the samples.
struct LineLocation {
  bool found = false;         ///< a line was found; the other members are valid
  double offset_px = 0.0;     ///< offset of the line, px
  double variance_px2 = 0.0;  ///< variance of the offset, px^2
  double height = 0.0;        ///< darkness in the middle of the line, grey levels
};

/// Fits height exp(-(k - offset)^2 / (2 blur^2)) to samples at each pixel k by least squares: the maximum of the
/// matched filter (Steger 1998, "An unbiased detector of curvilinear structures"). A faint shade next to the line has a
/// large effect on a centre of gravity and almost none on this estimate. The offset has a normal prior around the
/// middle. The variance accounts for the magnitude and the autocorrelation of the residuals.
/// @param dark        darkness across the needle, grey levels; an odd number of samples, at least 7
/// @param blur_px     standard deviation of the blur, px; > 0
/// @param prior_sd_px standard deviation of the prior of the offset, px; > 0
/// @return position; not found if a precondition is violated or no line is darker than its surroundings
LineLocation locate_line(const std::vector<double>& dark, double blur_px, double prior_sd_px);

}  // namespace bevel::camera
