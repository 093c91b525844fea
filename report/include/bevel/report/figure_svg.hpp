// SPDX-License-Identifier: MIT
// Figures as they stand on paper, and where no script runs.
#pragma once

#include <string>

#include <bevel/report/figure.hpp>

namespace bevel::report {

// An <svg> element so many pixels wide, with its legend above.
std::string figure_svg(const Figure& figure, double width_px = 832);
// Seen from where the page's own drawing is seen from at first.
std::string space_svg(const Space& space, double width_px = 832);

}  // namespace bevel::report
