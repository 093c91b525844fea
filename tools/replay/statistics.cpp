#include "tools/replay/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <map>
#include <numeric>

namespace bevel::replay {
namespace {

double quantile_of_mean(std::int64_t degrees, double probability) {
  if (degrees < 1) return 0;
  const double n = static_cast<double>(degrees);
  return boost::math::quantile(boost::math::chi_squared(n), probability) / n;
}

double median_variance(std::vector<double>& values) {
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double sd = *middle / 0.674489750196;  // of a normal
  return sd * sd;
}

}  // namespace

double ChiSquareMean::lowest() const { return quantile_of_mean(degrees, 0.025); }
double ChiSquareMean::highest() const { return quantile_of_mean(degrees, 0.975); }

LjungBox ljung_box(const std::vector<double>& series, int lags) {
  LjungBox result;
  const auto n = static_cast<int>(series.size());
  result.lags = std::min(lags, n / 4);
  if (result.lags < 1) return result;
  const double mean = std::accumulate(series.begin(), series.end(), 0.0) / n;
  const auto product = [&](int lag) {
    double sum = 0;
    for (int i = lag; i < n; ++i)
      sum += (series[static_cast<std::size_t>(i)] - mean) * (series[static_cast<std::size_t>(i - lag)] - mean);
    return sum;
  };
  const double variance = product(0);
  if (!(variance > 0)) return result;
  for (int lag = 1; lag <= result.lags; ++lag) {
    const double r = product(lag) / variance;
    result.statistic += r * r / (n - lag);
  }
  result.statistic *= static_cast<double>(n) * (n + 2);
  result.p_value = boost::math::cdf(
      boost::math::complement(boost::math::chi_squared(static_cast<double>(result.lags)), result.statistic));
  return result;
}

NoiseColour measure_noise(const std::vector<std::vector<AxisSample>>& recordings) {
  std::vector<double> over[2];
  for (const auto& samples : recordings) {
    std::map<std::int64_t, double> by_frame;
    for (const AxisSample& s : samples) by_frame.emplace(s.frame, s.value_mm);
    for (const auto& [frame, value] : by_frame)
      for (const int lag : {1, 2}) {
        const auto before = by_frame.find(frame - lag);
        const auto after = by_frame.find(frame + lag);
        if (before != by_frame.end() && after != by_frame.end())
          over[lag - 1].push_back(before->second - 2 * value + after->second);
      }
  }
  if (over[0].size() < 30 || over[1].size() < 30) return {};
  // Autocovariance sd^2 rho^j gives var(D_m) = sd^2 (6 - 8 rho^m + 2 rho^2m), so that the ratio of the two is
  // (1 + rho)(3 - rho^2) / (3 - rho): rising from 1 at rho = 0, so solved by bisection.
  const double variance = median_variance(over[0]);
  const double wanted = median_variance(over[1]) / variance;
  double low = 0;
  double high = 0.99;
  for (int i = 0; i < 60; ++i) {
    const double rho = 0.5 * (low + high);
    ((1 + rho) * (3 - rho * rho) / (3 - rho) < wanted ? low : high) = rho;
  }
  const double rho = 0.5 * (low + high);
  return {std::sqrt(variance / (6 - 8 * rho + 2 * rho * rho)), rho};
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

}  // namespace bevel::replay
