// SPDX-License-Identifier: MIT
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace bevel::inference {

// log of a sum of exponentials, of the largest first so that none overflows; minus infinity of nothing.
inline double log_sum(std::span<const double> logs) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const double one : logs) largest = std::max(largest, one);
  if (!std::isfinite(largest)) return largest;
  double sum = 0;
  for (const double one : logs) sum += std::exp(one - largest);
  return largest + std::log(sum);
}

}  // namespace bevel::inference
