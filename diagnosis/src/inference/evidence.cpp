// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/evidence.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/settle.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();

// By how much one log evidence is more than another; where there is none of either, it never is.
double log_change(double to, double from) { return std::isfinite(from) ? to - from : kNever; }

// Log evidence of a fit's linear model with these standard deviations, but for what does not depend on them.
double log_with_spread(const Fit& fit, const CurveColumns& curve, const VectorXd& nuisance_sd,
                       std::vector<ArrowBlock>& blocks) {
  const ArrowSolution solution = solve_at(nuisance_sd, fit, blocks, curve, std::vector<Index>{});
  return solution.valid ? -0.5 * (solution.least + solution.log_volume_ratio) : kNever;
}

// The same about a fit's mode, by the nonlinear model's cost there.
double log_about_mode(const Fit& fit, const CurveColumns& curve, const std::vector<ArrowBlock>& blocks) {
  const ArrowSolution solution = solve_about(fit, blocks, curve, std::vector<Index>{});
  return solution.valid ? -0.5 * (fit.cost + solution.log_volume_ratio) : kNever;
}

}  // namespace

std::vector<WithLessSpread> with_less_spread(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve) {
  std::vector<WithLessSpread> out;
  if (fit.scales.nuisance_sd.isZero(0)) return out;
  auto blocks = linearise(likelihood, fit, curve);
  if (blocks.empty()) return out;
  const double here = log_with_spread(fit, curve, fit.scales.nuisance_sd, blocks) +
                      log_prior_of_spread(likelihood.system(), fit.scales.nuisance_sd);
  auto all = less_spread(fit.scales.nuisance_sd);
  for (VectorXd& less : one_step_less_spread(likelihood.system(), fit.scales.nuisance_sd))
    if (std::ranges::find(all, less) == all.end()) all.push_back(std::move(less));
  for (const VectorXd& less : all) {
    WithLessSpread one{.fit = fit};
    one.fit.scales.nuisance_sd = less;
    one.log_change =
        log_change(log_with_spread(fit, curve, less, blocks) + log_prior_of_spread(likelihood.system(), less), here);
    out.push_back(std::move(one));
  }
  return out;
}

WithLessSpread at_its_mode(const WithLessSpread& less, const Fit& fit, const CurveColumns& curve) {
  const Likelihood& likelihood = *fit.likelihood;
  const auto log_about = [&](const Fit& at) {
    const auto blocks = linearise(likelihood, at, curve);
    if (!at.valid || blocks.empty()) return kNever;
    return log_about_mode(at, curve, blocks) + log_prior_of_spread(likelihood.system(), at.scales.nuisance_sd);
  };
  WithLessSpread out{.fit = inference::fit(likelihood, fit.layout, fit.shared, fit.local, less.fit.scales, curve)};
  out.fit.likelihood = fit.likelihood;
  out.log_change = log_change(log_about(out.fit), log_about(fit));
  return out;
}

Moved moved_to(const std::shared_ptr<const Likelihood>& likelihood, const Fit& from, const Discrepancy& discrepancy) {
  const CurveColumns curve_by_own = discrepancy.columns(*from.likelihood, from);
  const CurveColumns curve_by_this = discrepancy.columns(*likelihood, from);
  Moved out{.fit = fit(*likelihood, from.layout, from.shared, from.local, from.scales, curve_by_this,
                       {.own_volume = from.own_volume})};
  out.fit.likelihood = likelihood;
  if (!out.fit.valid) return out;
  const auto log_evidence = [](const Fit& at, const CurveColumns& curve, const std::vector<ArrowBlock>& blocks) {
    if (blocks.empty()) return kNever;
    return at.likelihood->log_weights() + log_about_mode(at, curve, blocks);
  };
  const auto here = linearise(*from.likelihood, from, curve_by_own);
  const auto there = linearise(*likelihood, out.fit, curve_by_this);
  out.log_change = log_change(log_evidence(out.fit, curve_by_this, there), log_evidence(from, curve_by_own, here));
  // By both noises where the fit is: what another place says more or less is not the noise's.
  const auto information = [&](const std::vector<ArrowBlock>& blocks) {
    VectorXd sum = VectorXd::Zero(from.shared.size());
    for (const ArrowBlock& block : blocks) sum += block.zz.diagonal().head(from.shared.size());
    return sum;
  };
  const VectorXd by_own = information(here), by_this = information(linearise(*likelihood, from, curve_by_this));
  double log_share = 0, count = 0;
  for (Index i = 0; i < by_own.size(); ++i)
    if (by_own[i] > 0 && by_this[i] > 0) {
      log_share += std::log(by_own[i] / by_this[i]);
      ++count;
    }
  if (count > 0) out.share_before = std::exp(log_share / count);
  return out;
}

Evaluated evaluate(const Likelihood& likelihood, const Layout& layout, const VectorXd& shared,
                   const std::vector<VectorXd>& local, const VectorXd& nuisance_sd, double give_up_below) {
  const NuisanceGrid grid = nuisance_grid(likelihood.system());
  Settled plain = settle(likelihood, nullptr, layout, shared, local, {.nuisance_sd = nuisance_sd, .curves = {}}, grid,
                         give_up_below);
  Evaluated out(std::move(plain.fit));
  out.log_evidence = plain.over.log_mean;
  out.nuisance_weights = plain.over.weights;
  out.valid = out.fit.valid && std::isfinite(out.log_evidence);
  out.given_up = out.log_evidence < give_up_below;
  return out;
}

}  // namespace bevel::inference
