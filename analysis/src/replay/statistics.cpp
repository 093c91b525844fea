// SPDX-License-Identifier: MIT
#include <bevel/analysis/replay/statistics.hpp>

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>
#include <map>

namespace bevel::analysis {
namespace {

double quantile_of_mean(std::int64_t degrees, double probability) {
  if (degrees < 1) return 0;
  const double n = static_cast<double>(degrees);
  return boost::math::quantile(boost::math::chi_squared(n), probability) / n;
}

// Variance of a normal with outliers in it: from the median absolute value, then from what lies within three standard
// deviations (where a normal keeps 97.33 % of its variance). The median
// alone takes every outlier for one more large value.
double robust_variance(std::vector<double>& values) {
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  double variance = std::pow(*middle / 0.674489750196, 2);
  for (int i = 0; i < 10; ++i) {
    double sum = 0;
    std::size_t kept = 0;
    for (const double v : values)
      if (v * v < 9 * variance) sum += v * v, ++kept;
    if (kept == 0) break;
    variance = sum / static_cast<double>(kept) / 0.97334;
  }
  return variance;
}

// Twice the reading less the line through its neighbours `lag` frames before and after.
void append_second_differences(const std::vector<AxisSample>& samples, int lag, std::vector<double>& out) {
  std::map<std::int64_t, const AxisSample*> by_frame;
  for (const AxisSample& s : samples) by_frame.emplace(s.frame, &s);
  for (const auto& [frame, now] : by_frame) {
    const auto before = by_frame.find(frame - lag);
    const auto after = by_frame.find(frame + lag);
    if (before == by_frame.end() || after == by_frame.end()) continue;
    // Over the insertion, not over time: starts, stops and uneven frame times do not count as noise.
    const double moved = after->second->insertion_mm - before->second->insertion_mm;
    const double share = std::abs(moved) > 1e-3 ? (now->insertion_mm - before->second->insertion_mm) / moved : 0.5;
    if (share < 0.3 || share > 0.7) continue;
    out.push_back(2 * (now->value_mm - (1 - share) * before->second->value_mm - share * after->second->value_mm));
  }
}

}  // namespace

double ChiSquareMean::lowest() const { return quantile_of_mean(degrees, 0.025); }
double ChiSquareMean::highest() const { return quantile_of_mean(degrees, 0.975); }

LjungBox ljung_box(const std::vector<double>& series, int lags) {
  const auto n = static_cast<int>(series.size());
  return diagnosis::ljung_box(Eigen::VectorXd::Map(series.data(), n), std::min(lags, n / 4));
}

NoiseColour measure_noise(const std::vector<std::vector<AxisSample>>& recordings) {
  constexpr std::array<int, 7> kLags = {1, 2, 3, 4, 6, 8, 10};
  std::array<double, kLags.size()> variance{};
  for (std::size_t l = 0; l < kLags.size(); ++l) {
    std::vector<double> differences;
    for (const auto& samples : recordings) append_second_differences(samples, kLags[l], differences);
    if (differences.size() < 30) return {};
    variance[l] = robust_variance(differences);
  }
  // Autocovariance sd^2 rho^j gives var(D_m) = sd^2 (6 - 8 rho^m + 2 rho^2m). For each rho the best sd in the
  // logarithm is a mean; rho by search.
  NoiseColour best;
  double least = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= 196; ++step) {
    const double rho = 0.005 * step;
    double mean = 0;
    double squares = 0;
    for (std::size_t l = 0; l < kLags.size(); ++l) {
      const double kept = std::pow(rho, kLags[l]);
      const double excess = std::log(variance[l] / (6 - 8 * kept + 2 * kept * kept));
      mean += excess / kLags.size();
      squares += excess * excess / kLags.size();
    }
    if (squares - mean * mean < least) {
      least = squares - mean * mean;
      best = {std::exp(0.5 * mean), rho};
    }
  }
  return best;
}

std::vector<double> whiten(const std::vector<Innovation>& innovations, const NoiseColour& noise) {
  std::vector<double> white;
  for (std::size_t i = 0; i < innovations.size(); ++i) {
    const Innovation& now = innovations[i];
    double value = now.value_mm;
    double kept = 0;  // correlation with the one before
    if (i > 0) {
      kept = std::pow(noise.rho, static_cast<double>(std::max<std::int64_t>(1, now.frame - innovations[i - 1].frame)));
      value -= kept * innovations[i - 1].value_mm;
    }
    const double variance =
        noise.sd_mm * noise.sd_mm * (1 - kept * kept) + (1 - kept) * (1 - kept) * now.state_variance_mm2;
    white.push_back(value / std::sqrt(variance));
  }
  return white;
}

}  // namespace bevel::analysis
