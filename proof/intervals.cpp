// SPDX-License-Identifier: MIT
#include "proof/intervals.hpp"

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <cmath>

namespace bevel::proof {
namespace {

double upper(const Share& share, double tail) {
  if (share.hits >= share.of) return 1.0;
  return boost::math::quantile(boost::math::beta_distribution<>(share.hits + 1.0, share.of - share.hits), 1.0 - tail);
}

double lower(const Share& share, double tail) {
  if (share.hits <= 0) return 0.0;
  return boost::math::quantile(boost::math::beta_distribution<>(share.hits, share.of - share.hits + 1.0), tail);
}

}  // namespace

Interval wilson95(const Share& share) {
  if (share.of <= 0) return {0.0, 1.0};
  constexpr double kZ = 1.959963984540054;
  const double n = share.of;
  const double p = share.value();
  const double centre = (p + kZ * kZ / (2 * n)) / (1 + kZ * kZ / n);
  const double half = kZ / (1 + kZ * kZ / n) * std::sqrt(p * (1 - p) / n + kZ * kZ / (4 * n * n));
  return {std::max(0.0, centre - half), std::min(1.0, centre + half)};
}

Interval clopper_pearson95(const Share& share) { return {lower(share, 0.025), upper(share, 0.025)}; }

double clopper_pearson_upper95(const Share& share) { return upper(share, 0.05); }

}  // namespace bevel::proof
