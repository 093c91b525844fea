#include "diagnosis/inference/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "diagnosis/inference/log_sum.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

ArrowSolution solve_without(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                            std::size_t recording) {
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.scales, fit.curve_values, curve.covariance);
  ArrowRules rules;
  rules.used.assign(blocks.size(), true);
  if (recording < blocks.size()) rules.used[recording] = false;
  rules.held = fit.held;
  return solve(blocks, pulls.precision, pulls.centre, rules);
}

}  // namespace

std::vector<std::string> Posterior::named() const {
  std::vector<std::string> out;
  for (const auto& [name, probability] : inclusion)
    if (probability > 0.5) out.push_back(name);
  return out;
}

Posterior posterior_of(const Search& search, double discrepancy_size) {
  Posterior out;
  std::vector<double> logs;
  for (const auto& [set, one] : search.visited()) logs.push_back(one.log_posterior());
  logs.push_back(search.log_not_visited());
  const double all = log_sum(logs);
  out.not_visited = std::exp(logs.back() - all);
  const auto& effects = search.system().effects();
  for (const auto& [set, one] : search.visited()) {
    const SetShare share{set, std::exp(one.log_posterior() - all), std::exp(one.log_with_curve - all)};
    std::set<std::string> names;
    for (const std::size_t e : set) names.insert(effects[e].name);
    for (const auto& name : names) out.inclusion[name] += share.probability;
    if (one.at->fit_with_curve) {
      const Fit& fit = *one.at->fit_with_curve;
      if (search.discrepancy().visible_size(*fit.scales.curve, fit.curve_values) > discrepancy_size)
        out.discrepancy += share.with_discrepancy;
    }
    out.sets.push_back(share);
  }
  std::stable_sort(out.sets.begin(), out.sets.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
  return out;
}

double log_predictive(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                      std::size_t recording) {
  const ArrowSolution all = solve_without(fit, blocks, curve, blocks.size());
  const ArrowSolution rest = solve_without(fit, blocks, curve, recording);
  return fit.likelihood->log_weights(recording) -
         0.5 * (all.least - rest.least + all.log_volume_ratio - rest.log_volume_ratio);
}

VectorXd shared_without(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                        std::size_t recording) {
  VectorXd shared = fit.shared + solve_without(fit, blocks, curve, recording).shared.head(fit.shared.size());
  std::vector<VectorXd> local = fit.local;
  fit.layout.clamp(shared, local);
  return shared;
}

std::vector<double> held_out_log_density(const Search& search) {
  const std::size_t recordings = search.system().data().recordings.size();
  // Per set, with and without its curve: log of prior times evidence, and each recording's part.
  std::vector<double> whole;
  std::vector<std::vector<double>> parts;
  for (const auto& [set, one] : search.visited()) {
    const auto add = [&](double log, const Fit& fit) {
      const CurveColumns curve =
          fit.scales.curve ? search.discrepancy().columns(*fit.likelihood, *fit.scales.curve) : CurveColumns{};
      const auto blocks = linearise(*fit.likelihood, fit, curve);
      if (blocks.empty()) return;
      whole.push_back(log);
      parts.emplace_back();
      for (std::size_t r = 0; r < recordings; ++r) parts.back().push_back(log_predictive(fit, blocks, curve, r));
    };
    add(one.log_without_curve, one.at->fit);
    if (one.at->fit_with_curve) add(one.log_with_curve, *one.at->fit_with_curve);
  }
  std::vector<double> out;
  for (std::size_t r = 0; r < recordings; ++r) {
    std::vector<double> without;
    for (std::size_t i = 0; i < whole.size(); ++i) without.push_back(whole[i] - parts[i][r]);
    out.push_back(log_sum(whole) - log_sum(without));
  }
  return out;
}

}  // namespace bevel::inference
