// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Limit above which a residual counts as an outlier.

#include <algorithm>
#include <cmath>
#include <vector>

namespace bevel::io {

/// Returns five robust standard deviations of residuals, 1.4826 times the median of their magnitudes each. A normal
/// distribution exceeds this limit in 6 of 10 million values.
/// @param residuals  not empty, with either sign
/// @param least  smallest standard deviation: that of the measurements
inline double outlier_limit(std::vector<double> residuals, double least) {
  for (double& residual : residuals) residual = std::abs(residual);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::ranges::nth_element(residuals, middle);
  return 5 * std::max(1.4826 * *middle, least);
}

/// Number of times that a fit leaves out outliers and is repeated, at most.
inline constexpr int kOutlierPasses = 5;

}  // namespace bevel::io
