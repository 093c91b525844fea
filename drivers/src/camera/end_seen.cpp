// SPDX-License-Identifier: MIT
#include "camera/end_problem.hpp"

#include <algorithm>
#include <cmath>

namespace bevel::camera::end {

cv::Vec2d Problem::seen(const Vector& p, const BlurredBevel& table) const {
  double low = -4.0 * priors_.blur_px, high = std::exp(p[log_bevel]) + 4.0 * priors_.blur_px;
  const auto dark_at = [&](double x) { return table.at(x).moments.dark(p[pale]); };
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    (dark_at(middle).share < kSeenShare ? low : high) = middle;
  }
  // In the middle of the last needle's width before it, the darker the more.
  double aside = 0.0, weights = 0.0;
  constexpr int steps = 8;
  for (int i = 0; i < steps; ++i) {
    const double x = high + 2.0 * priors_.radius_px * (i + 0.5) / steps;
    const Moments dark = dark_at(x);
    aside += dark.share * priors_.radius_px * dark.moment, weights += dark.share * dark.share;
  }
  aside /= weights;
  const double s_px = p[tip] - high;
  return {s_px, offset(p, s_px) + aside};
}

cv::Vec2d Problem::more_than_chance(double offset_px, double variance_px2) const {
  const double likely_px2 = priors_.radius_px * priors_.radius_px;
  const double share = likely_px2 / (likely_px2 + variance_px2);
  return {share * offset_px, share * variance_px2};
}

cv::Vec2d Problem::beyond_model(const Vector& p, const Noise& noise, double about_s) {
  build(p, tables_, true);
  double weighted = 0.0, squares = 0.0;
  Sample sample_i;
  for (int i = 0; i < size(); ++i) {
    if (std::abs(s(i) - about_s) > priors_.radius_px) continue;
    sample(p, tables_, i, true, sample_i);
    for (const int channel : {0, 2}) {
      const double g = sample_i.gradient[channel][tip];
      const double w = noise.information(channel);
      weighted += w * g * sample_i.residual[channel], squares += w * g * g;
    }
  }
  if (squares <= 0.0) return {0.0, 0.0};
  return more_than_chance(weighted / squares, 1.0 / squares);
}

Problem::Seen Problem::seen_with_gradient(const Vector& p) const {
  Seen out;
  out.place = seen(p, tables_.here);
  for (const int k : {tip, roll, log_bevel, pale, c0, c1, c2}) {  // no bend lies so near the end
    const double step = k == roll ? kRollStep_rad : k == log_bevel ? kLogStep : 0.02;
    Vector moved = p;
    moved[k] += step;
    const BlurredBevel& table = k == roll ? tables_.rolled : k == log_bevel ? tables_.longer : tables_.here;
    const cv::Vec2d change = (seen(moved, table) - out.place) * (1.0 / step);
    out.by_s[k] = change[0], out.by_across[k] = change[1];
  }
  return out;
}

}  // namespace bevel::camera::end
