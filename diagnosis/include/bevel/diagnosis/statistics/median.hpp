// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Median of a list of values.
#include <algorithm>
#include <cstddef>
#include <vector>

namespace bevel::diagnosis {

/// Computes the median.
/// @param values the values, in any order and unit
/// @return the middle value, of an even count the upper of the two; 0 if there is no value
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace bevel::diagnosis
