// SPDX-License-Identifier: MIT
#pragma once
// Where across the needle its last, thinnest part lies: least squares of a line that is thinner than the lens's blur.
#include <vector>

namespace bevel::camera {

/// A line found in darkness across; offsets in px from the middle of the samples.
struct LineLocation {
  bool found = false;
  double offset_px = 0.0;
  double variance_px2 = 0.0;
  double height = 0.0;  ///< darkness in its middle, gray
};

/// Least squares of height exp(-(k - offset)^2 / (2 blur^2)) to `dark`, sampled at every pixel k about the middle: the
/// maximum of the matched filter (Steger 1998, "An unbiased detector of curvilinear structures"). A pale shade beside
/// the line moves a centre of gravity by its whole lever and this by next to nothing. The offset is sought within
/// `prior_sd_px` of the middle, softly: a normal prior. The variance is that of the residuals as they are found, as
/// correlated as they are.
LineLocation locate_line(const std::vector<double>& dark, double blur_px, double prior_sd_px);

}  // namespace bevel::camera
