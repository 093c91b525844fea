// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/prediction_noise.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/error_spread.hpp>
#include "inference/minimum.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr int kSteps = 20;
constexpr double kAlike = 0.01;  // of a standard deviation, as a share, and of an autocorrelation
constexpr double kLargestAr1 = 0.98;

// With a mean of the nuisances as the last shared unknowns, where it is one.
std::vector<RawRows> raw_of(const LinearModel& model, const CurveColumns& curve) {
  std::vector<RawRows> out = raw_rows(*model.fit, curve);
  if (const Index means = model.mean.size(); means > 0)
    for (RawRows& one : out) {
      one.Z.conservativeResize(Eigen::NoChange, one.Z.cols() + means);
      one.Z.rightCols(means) = one.L.leftCols(means);
    }
  return out;
}

// The likeliest noise of one channel by such errors, recording after recording.
void maximise(const Dataset& data, const ErrorsByChannel& errors, std::size_t channel, Noise& noise) {
  const auto deviance_at = [&](double ar1, double& sigma) {
    Noise one = noise.of(channel);
    one.ar1 = ar1, one.ar2 = 0;
    double squares = 0, count = 0, logs = 0;
    for (std::size_t r = 0; r < errors.size(); ++r) {
      const Whitening whitening = make_whitening(data.recordings[r].series[channel], one, 1.0);
      squares += errors[r][channel].whitened_squares(whitening).sum();
      count += static_cast<double>(whitening.weight.size());
      for (const double weight : whitening.weight) logs -= 2 * std::log(weight);
    }
    sigma = std::sqrt(std::max(squares / std::max(count, 1.0), 1e-18));
    return 2 * count * std::log(sigma) + logs;
  };
  constexpr double kWidth = 0.003;
  double sigma = 0;
  const double found = minimum_of(0, kLargestAr1, kWidth, [&](double ar1) { return deviance_at(ar1, sigma); });
  noise.own_ar1[channel] = found <= 0.5 * kWidth ? 0 : found;  // nothing was found to lie above it
  deviance_at(noise.own_ar1[channel], noise.sigma[channel]);
}

// Each group's standard deviation in turn at its likeliest.
ArrowSolution solve_at_likeliest(const LinearModel& model, std::vector<ArrowBlock>& blocks, Pulls& pulls,
                                 const ArrowRules& rules, bool seek, VectorXd& nuisance_sd) {
  const Layout& layout = model.fit->layout;
  const auto& groups = layout.system().nuisance_groups();
  const auto at = [&](const VectorXd& sd, bool covariance) {
    const VectorXd precision = local_precision_of(layout, {.nuisance_sd = sd, .curves = {}});
    for (ArrowBlock& block : blocks) block.precision = precision;
    if (model.mean.size() > 0)
      pulls.precision.diagonal().tail(model.mean.size()) = mean_precision_of(layout.system(), sd);
    ArrowRules how = rules;
    if (covariance) how.covariance_of.reset();
    return solve(blocks, pulls.precision, pulls.centre, how);
  };
  for (std::size_t g = 0; seek && g < groups.size(); ++g) {
    const auto& values = groups[g].standard_deviations;
    double most = -std::numeric_limits<double>::infinity(), best = nuisance_sd[static_cast<Index>(g)];
    for (const double value : values) {
      VectorXd trial = nuisance_sd;
      trial[static_cast<Index>(g)] = value;
      const ArrowSolution one = at(trial, false);
      if (!one.valid) continue;
      const double prior =
          value == values.front() ? 0 : -std::log(std::max<double>(1, static_cast<double>(values.size() - 1)));
      const double log = prior - 0.5 * (one.least + one.log_volume_ratio);
      if (log > most) most = log, best = value;
    }
    nuisance_sd[static_cast<Index>(g)] = best;
  }
  return at(nuisance_sd, true);
}

}  // namespace

Noise prediction_noise(const LinearModel& model, const CurveColumns& curve) {
  const Fit& fit = *model.fit;
  const Dataset& data = fit.likelihood->data();
  const auto raw = raw_of(model, curve);
  Noise noise = fit.likelihood->noise();
  if (raw.empty()) return noise;
  const std::size_t channels = noise.sigma.size();
  noise.own_ar1.assign(channels, 0);  // from a high one the steps are too small to leave it
  Pulls pulls = pulls_with_mean(pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance), model.mean);
  ArrowRules rules{.held = fit.held, .covariance_of = std::vector<Index>{}};
  // To begin with they may differ by all that is tried: the noise is what that leaves, and not the other way.
  VectorXd nuisance_sd = fit.scales.nuisance_sd;
  for (Index g = 0; g < nuisance_sd.size(); ++g)
    nuisance_sd[g] = fit.layout.system().nuisance_groups()[static_cast<std::size_t>(g)].standard_deviations.back();
  std::vector<ArrowBlock> blocks(raw.size());
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t r = 0; r < raw.size(); ++r) {
      blocks[r] = block_by(raw[r], data.recordings[r], noise);
      blocks[r].centre = model.blocks[r].centre;
    }
    const ArrowSolution solution = solve_at_likeliest(model, blocks, pulls, rules, step > 0, nuisance_sd);
    if (!solution.valid) break;
    ErrorsByChannel errors;
    for (std::size_t r = 0; r < raw.size(); ++r)
      errors.push_back(expected_errors(raw[r], data.recordings[r], blocks[r], solution, r));
    const Noise before = noise;
    for (std::size_t c = 0; c < channels; ++c) maximise(data, errors, c, noise);
    double change = 0;
    for (std::size_t c = 0; c < channels; ++c)
      change = std::max({change, std::abs(std::log(noise.sigma[c] / before.sigma[c])),
                         std::abs(noise.own_ar1[c] - before.own_ar1[c])});
    if (change < kAlike) break;
  }
  return noise;
}

}  // namespace bevel::inference
