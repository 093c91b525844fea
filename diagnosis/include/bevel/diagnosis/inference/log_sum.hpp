// SPDX-License-Identifier: MIT
/// @file
/// Logarithm of a sum of exponentials.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace bevel::inference {

/// Computes the natural log of a sum of exponentials, relative to the largest so that none overflows.
/// @param logs Natural logs.
/// @return Log of the sum; -infinity for an empty list.
inline double log_sum(std::span<const double> logs) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const double one : logs) largest = std::max(largest, one);
  if (!std::isfinite(largest)) return largest;
  double sum = 0;
  for (const double one : logs) sum += std::exp(one - largest);
  return largest + std::log(sum);
}

}  // namespace bevel::inference
