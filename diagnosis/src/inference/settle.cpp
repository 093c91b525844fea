// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/settle.hpp>

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/absorbed_instants.hpp>
#include <bevel/diagnosis/inference/curved_fit.hpp>
#include <bevel/diagnosis/inference/error_spread.hpp>
#include <bevel/diagnosis/inference/local_minima.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/inference/own_volume.hpp>
#include <bevel/diagnosis/inference/spread_search.hpp>
#include "inference/instant_posterior.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kWorthARefit = 0.2;  // of log evidence: what another spread has to promise
// Spreads are looked at beside those whose log posterior is no farther below the likeliest's.
constexpr double kOnTheWay = 0;    // while fit and noise still move
constexpr double kWithAShare = 6;  // where they end
constexpr int kAstray = 3;         // passes that come to less, one after the other: they go round
constexpr int kRefits = 12;        // with the standard deviations and the curve at their likeliest

double beta_binomial(int happened, int recordings) {
  // Not std::lgamma: it writes its sign into a global of the C library, from every thread.
  return std::log(boost::math::beta(kHappens + happened, kHappensNot + recordings - happened) /
                  boost::math::beta(kHappens, kHappensNot));
}

// What instants add to a set's evidence: how often they happen, and the share of a recording in which each may have
// happened, all else held. Of those that are fitted the arrow has the volume together with all else, by the linear
// model: with it as it is alone by the likelihood itself, no density being normal far from its mode.
double log_prior_of_instants(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                             const std::vector<ArrowBlock>& blocks) {
  const auto free = free_locals(fit.layout);
  double sum = 0;
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i) {
    if (!fit.layout.is_instant(i)) continue;
    const auto place = static_cast<Index>(std::ranges::find(free, static_cast<Index>(i)) - free.begin());
    int happened = 0;
    for (std::size_t r = 0; r < fit.local.size(); ++r)
      if (fit.local[r][static_cast<Index>(i)] > 0) {
        ++happened;
        sum += std::log(instant_posterior(likelihood, fit, curve, r, i).width_s / fit.layout.upper(i, r));
        if (fit.layout.is_fitted(i)) sum += 0.5 * std::log1p(blocks[r].ll(place, place) / blocks[r].precision[place]);
      }
    sum += beta_binomial(happened, static_cast<int>(fit.local.size()));
  }
  return sum;
}

double log_density_ratios(const Fit& fit, const MatrixXd& covariance) {
  double sum = 0;
  for (Index i = 0; i < fit.shared.size(); ++i)
    sum += log_density_ratio(fit.layout.shared()[static_cast<std::size_t>(i)].parameter->prior, fit.shared[i],
                             std::sqrt(std::max(covariance(i, i), 0.0)));
  return sum;
}

// At the mode squares count in full; what follows from its neighbourhood, by their information (heavy_tails.hpp).
double beyond_information(const Likelihood& likelihood, const std::vector<ArrowBlock>& blocks) {
  const double information = likelihood.information();
  double squares = 0;
  for (const ArrowBlock& block : blocks) squares += block.ww;
  return 0.5 * (1 / information - 1) * (information * static_cast<double>(likelihood.data().rows()) - squares);
}

// Over the grid of the nuisances' standard deviations, about one mode. The mode's own cost is that of the nonlinear
// model; the linear one says how it changes over the grid, and what it promises elsewhere counts for no more than what
// was found here (settle() goes and looks).
GridEvidence over_nuisances(const Fit& fit, const CurveColumns& curve, const NuisanceGrid& grid, double far_below) {
  GridEvidence out;
  const Likelihood& likelihood = *fit.likelihood;
  auto blocks = linearise(likelihood, fit, curve);
  if (blocks.empty()) return out;
  // Of the shared unknowns' errors only those whose prior is not normal matter.
  std::vector<Index> not_normal;
  for (Index i = 0; i < fit.shared.size(); ++i)
    if (fit.layout.shared()[static_cast<std::size_t>(i)].parameter->prior.form != Prior::Form::normal)
      not_normal.push_back(i);
  const ArrowSolution about = solve_about(fit, blocks, curve, std::vector<Index>{});
  if (!about.valid) return out;
  const double here = about.least;
  const Index start = column_of(likelihood.system(), fit.scales.nuisance_sd);
  VectorXd logs = over_likely(likelihood.system(), start, far_below, [&](Index k) {
    const ArrowSolution solution = solve_at(grid.standard_deviations.col(k), fit, blocks, curve, not_normal);
    return solution.valid ? -0.5 * (fit.cost + solution.least - here + solution.log_volume_ratio) +
                                log_density_ratios(fit, solution.covariance) + grid.log_prior[k]
                          : -std::numeric_limits<double>::infinity();
  });
  out.log_here = logs[start];
  out.promised = logs;
  out.log_promised = logs.maxCoeff();
  logs = logs.cwiseMin(out.log_here);
  const double all = log_sum(std::span<const double>(logs.data(), static_cast<std::size_t>(logs.size())));
  out.weights = (logs.array() - all).exp();
  const double constant = likelihood.log_weights() + log_prior_of_instants(likelihood, fit, curve, blocks) +
                          beyond_information(likelihood, blocks);
  out.log_here += constant;
  out.log_promised += constant;
  out.log_mean = all + constant;
  return out;
}

bool alike(const std::vector<VectorXd>& a, const std::vector<VectorXd>& b, const Likelihood& likelihood) {
  constexpr double kShare = 0.2;  // of the noise
  if (a.size() != b.size()) return false;
  const auto& sigma = likelihood.noise().sigma;
  const double least = *std::min_element(sigma.begin(), sigma.end());
  for (std::size_t r = 0; r < a.size(); ++r)
    if ((a[r] - b[r]).cwiseAbs().maxCoeff() > kShare * least) return false;
  return true;
}

}  // namespace

Settled settle(const Likelihood& likelihood, const Discrepancy* discrepancy, const Layout& layout, VectorXd shared,
               std::vector<VectorXd> local, Scales scales, const NuisanceGrid& grid, double give_up_below,
               std::shared_ptr<const CurveTangent> tangent) {
  auto now = std::make_shared<const Likelihood>(likelihood);
  CurveColumns curve;
  Settled best{.fit = Fit(layout), .over = {}};
  std::vector<VectorXd> inputs, inputs_of_best;
  SpreadSearch spreads(likelihood.system());
  bool noise_moved = false, spread_moved = false;
  int astray = 0;
  // What has many local minima is scanned with the rest as it stands at first, and by the noise where that rests.
  bool to_scan = true, scanned_by_noise = true;
  double most_promised = -std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < kRefits; ++pass) {
    Settled one{.fit = discrepancy ? fit_beside_curves(*now, *discrepancy, layout, shared, local, scales, tangent)
                                   : fit(*now, layout, shared, local, scales),
                .over = {}};
    if (!one.fit.valid) break;
    if (discrepancy) curve = discrepancy->columns(*now, one.fit);
    if (to_scan) {
      scan_locals(*now, curve, one.fit);
      doubt_instants(*now, curve, one.fit);
      look_from_alike(*now, curve, one.fit);
      scanned_by_noise = true;
    }
    if (pass == 0) scan_shapes(*now, curve, one.fit);
    one.fit.likelihood = now;
    one.over = over_nuisances(one.fit, curve, grid, kOnTheWay);
    if (one.over.promised.size() == 0) break;  // no mode there
    // The linear model promised what is not there: back to the likeliest, and to what that promises next.
    const bool lost = spread_moved && one.over.log_here < best.over.log_here;
    const Index spread = column_of(likelihood.system(), scales.nuisance_sd);
    spreads.tried(spread);
    if (one.over.log_here > best.over.log_here) {
      best = one, inputs_of_best = inputs;
      astray = 0;
    } else if (!spread_moved && ++astray == kAstray) {
      break;
    }
    // Not before the noise had its turn: what a wrong model leaves passes for noise. And by any noise that it had: what
    // the noise took at first the spread is promised only when it has given it back.
    most_promised = std::max(most_promised, one.over.log_promised);
    if (pass > 1 && most_promised < give_up_below) break;
    if (lost) {
      one = best, inputs = inputs_of_best;
      now = one.fit.likelihood;
      scales = one.fit.scales;
      spreads.lost(spread, column_of(likelihood.system(), scales.nuisance_sd));
      noise_moved = false;
    } else {
      if (spread_moved) spreads.gained();
      // The noise first, then what differs between recordings: by a wrong noise they do not differ.
      const NoiseBeside noise = noise_beside(one.fit, curve);
      auto open = inputs_about(one.fit);
      noise_moved = !alike(noise, *now) || !alike(open, inputs, *now);
      if (noise_moved) {
        inputs = std::move(open);
        now = std::make_shared<const Likelihood>(likelihood, noise.noise, inputs, noise.precision);
        scanned_by_noise = false;
      }
    }
    spread_moved = false;
    // A curve that is large has another scale than the linear model about none saw.
    bool curves_moved = false;
    if (!noise_moved && !lost && one.fit.tangent) {
      auto priors = likeliest_priors(*discrepancy, one.fit, curve, kWorthARefit);
      curves_moved = priors != scales.curves;
      scales.curves = std::move(priors);
    }
    to_scan = !noise_moved && !curves_moved && !scanned_by_noise && has_scanned(layout);
    if (!noise_moved && !curves_moved && !to_scan) {
      const Index here = column_of(likelihood.system(), scales.nuisance_sd);
      const Index next = spreads.next(one.over.promised, here, kWorthARefit);
      if (next == here) break;
      scales.nuisance_sd = grid.standard_deviations.col(next);
      spread_moved = true;
    }
    shared = one.fit.shared;
    local = one.fit.local;
    tangent = one.fit.tangent;
  }
  if (!best.fit.valid) return best;
  if (discrepancy) curve = discrepancy->columns(*best.fit.likelihood, best.fit);
  if (!(best.over.log_here < give_up_below)) {
    const auto by = best.fit.likelihood;
    const CurveAt curve_at =
        best.fit.tangent ? about_values(*discrepancy, *by, best.fit.scales.curves) : everywhere(curve);
    best.fit = with_own_integrated(std::move(best.fit), curve_at);
    if (best.fit.tangent) curve = discrepancy->columns(*by, best.fit);
  }
  best.over = over_nuisances(best.fit, curve, grid, kWithAShare);
  return best;
}

}  // namespace bevel::inference
