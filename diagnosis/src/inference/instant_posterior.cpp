// SPDX-License-Identifier: MIT
#include "inference/instant_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {
constexpr double kNegligible = 20;  // of chi2: readings beyond it have no part in an integral
}

InstantPosterior instant_posterior(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                                   std::size_t r, std::size_t local) {
  const double duration_s = fit.layout.upper(local, r);
  const double at_s = fit.local[r][static_cast<Index>(local)];
  Residuals residuals;
  VectorXd values = fit.local[r];
  const auto chi2_at = [&](double value) {
    values[static_cast<Index>(local)] = value;
    if (!likelihood.evaluate(fit.layout, r, fit.shared, values, false, residuals, curve, fit.curve_values))
      return std::numeric_limits<double>::infinity();
    return residuals.white.squaredNorm();
  };
  const double best = chi2_at(at_s);
  // Outwards with growing steps until nothing is left; probabilities of the steps, in order of time.
  std::vector<std::pair<double, double>> steps;
  for (const double direction : {-1.0, 1.0}) {
    double step_s = 0.002, away_s = 0, before = 1;
    for (int i = 0; i < 60; ++i) {
      away_s += step_s;
      const double where_s = at_s + direction * away_s;
      if (where_s <= 0 || where_s >= duration_s) break;
      const double now = std::min(1.0, std::exp(-0.5 * (chi2_at(where_s) - best)));
      steps.emplace_back(where_s - direction * 0.5 * step_s, 0.5 * step_s * (before + now));
      before = now;
      if (now < std::exp(-0.5 * kNegligible)) break;
      step_s = std::min(step_s * 1.3, 0.1);
    }
    if (direction < 0) std::reverse(steps.begin(), steps.end());
  }
  InstantPosterior out;
  double sum = 0, first = 0, second = 0;
  for (const auto& [where_s, weight] : steps)
    sum += weight, first += weight * where_s, second += weight * where_s * where_s;
  out.width_s = std::max(sum, 1e-4);
  if (!(sum > 0)) {
    out.mean_s = out.low_s = out.high_s = at_s;
    return out;
  }
  out.mean_s = first / sum;
  out.sd_s = std::sqrt(std::max(0.0, second / sum - out.mean_s * out.mean_s));
  double below = 0;
  for (const auto& [where_s, weight] : steps) {
    if (below < 0.025 * sum) out.low_s = where_s;
    if (below < 0.975 * sum) out.high_s = where_s;
    below += weight;
  }
  return out;
}

}  // namespace bevel::inference
