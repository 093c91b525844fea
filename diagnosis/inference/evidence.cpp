#include "diagnosis/inference/evidence.hpp"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "diagnosis/inference/error_spread.hpp"
#include "diagnosis/inference/local_minima.hpp"
#include "diagnosis/inference/log_sum.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kWorthARefit = 0.2;     // of log evidence
constexpr double kWhileUnsettled = 0.5;  // of a fit's cost
// Spreads are looked at beside those whose log posterior is no farther below the likeliest's.
constexpr double kOnTheWay = 0;     // while fit and noise still move
constexpr double kWithAShare = 6;   // where they end
constexpr int kRefits = 12;         // with the standard deviations and the curve at their likeliest
constexpr double kLikelyCurve = 3;  // log Bayes factor from which a curve is fitted
constexpr double kNegligible = 20;  // of chi2: readings beyond it have no part in an integral

double beta_binomial(int happened, int recordings) {
  // Not std::lgamma: it writes its sign into a global of the C library, from every thread.
  return std::log(boost::math::beta(kHappens + happened, kHappensNot + recordings - happened) /
                  boost::math::beta(kHappens, kHappensNot));
}

double log_prior_of_instants(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve) {
  double sum = 0;
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i) {
    if (!fit.layout.is_instant(i)) continue;
    int happened = 0;
    for (std::size_t r = 0; r < fit.local.size(); ++r)
      if (fit.local[r][static_cast<Index>(i)] > 0) {
        ++happened;
        sum += std::log(instant_posterior(likelihood, fit, curve, r, i).width_s / fit.layout.upper(i, r));
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

struct GridEvidence {
  double log_here = -std::numeric_limits<double>::infinity();      // at the standard deviations of the fit
  double log_promised = -std::numeric_limits<double>::infinity();  // at the best of the grid, by the linear model
  double log_mean = -std::numeric_limits<double>::infinity();      // over the grid
  VectorXd promised;                                               // of each combination, by the linear model
  VectorXd weights;
};

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
  const double here = solve_about(fit, blocks, curve, not_normal).least;
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
  const double constant =
      likelihood.log_weights() + log_prior_of_instants(likelihood, fit, curve) + beyond_information(likelihood, blocks);
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

struct Settled {
  Fit fit;
  GridEvidence over;
};

// The combination that promises most, of those where no fit was made; here: where none promises more.
Index next_spread(const VectorXd& promised, const std::set<Index>& tried, Index here) {
  Index best = here;
  for (Index k = 0; k < promised.size(); ++k)
    if (promised[k] > promised[best] && !tried.contains(k)) best = k;
  return best;
}

// Fit, noise (with what the inputs leave open) and the nuisances' standard deviations in turn, until none changes.
Settled settle(const Likelihood& likelihood, const Discrepancy* discrepancy, const Layout& layout, VectorXd shared,
               std::vector<VectorXd> local, Scales scales, const NuisanceGrid& grid, double give_up_below) {
  auto now = std::make_shared<const Likelihood>(likelihood);
  CurveColumns curve;
  Settled best{.fit = Fit(layout), .over = {}};
  std::vector<VectorXd> inputs, inputs_of_best;
  std::set<Index> tried;
  bool noise_moved = false, spread_moved = false, settled = false;
  for (int pass = 0; pass < kRefits; ++pass) {
    if (discrepancy) curve = discrepancy->columns(*now, scales.curves);
    // What will move with the noise need not be known to the end.
    const FitRules rules{.tolerance = settled ? FitRules{}.tolerance : kWhileUnsettled};
    Settled one{.fit = fit(*now, layout, shared, local, scales, curve, rules), .over = {}};
    if (!one.fit.valid) break;
    // What has many local minima is scanned, with the rest as it now stands.
    if (pass == 0 || noise_moved) {
      scan_locals(*now, curve, one.fit);
      doubt_instants(*now, curve, one.fit);
      if (pass < 2) scan_shapes(*now, curve, one.fit);
    }
    one.fit.likelihood = now;
    one.over = over_nuisances(one.fit, curve, grid, kOnTheWay);
    const bool better = one.over.log_here > best.over.log_here + kWorthARefit;
    // The linear model promised what is not there: back to the likeliest, and to what that promises next.
    const bool lost = spread_moved && one.over.log_here < best.over.log_here;
    if (one.over.log_here > best.over.log_here) best = one, inputs_of_best = inputs;
    // Not before the noise had its turn: what a wrong model leaves passes for noise.
    if (pass > 1 && best.over.log_promised < give_up_below) break;
    if (lost) {
      one = best, inputs = inputs_of_best;
      now = one.fit.likelihood;
      scales = one.fit.scales;
      noise_moved = settled = false;
    } else {
      if (!better && !noise_moved && settled) break;
      // The noise first, then what differs between recordings: by a wrong noise they do not differ.
      const NoiseBeside noise = noise_beside(one.fit, curve);
      auto open = inputs_about(one.fit);
      noise_moved = !alike(noise, *now) || !alike(open, inputs, *now);
      if (noise_moved) {
        inputs = std::move(open);
        now = std::make_shared<const Likelihood>(likelihood, noise.noise, inputs, noise.precision);
      }
    }
    spread_moved = false;
    if (!noise_moved) {
      const Index here = column_of(likelihood.system(), scales.nuisance_sd);
      tried.insert(here);
      if (const Index next = next_spread(one.over.promised, tried, here); next != here) {
        scales.nuisance_sd = grid.standard_deviations.col(next);
        spread_moved = true;
      } else if (!settled) {
        settled = true;
      } else {
        break;
      }
    }
    shared = one.fit.shared;
    local = one.fit.local;
  }
  if (!best.fit.valid) return best;
  if (discrepancy) curve = discrepancy->columns(*best.fit.likelihood, best.fit.scales.curves);
  best.over = over_nuisances(best.fit, curve, grid, kWithAShare);
  return best;
}

}  // namespace

std::vector<LessSpread> with_less_spread(const Likelihood& likelihood, const Fit& fit) {
  std::vector<LessSpread> out;
  auto blocks = linearise(likelihood, fit, {});
  if (blocks.empty()) return out;
  const auto log_of = [&](const Fit& about) {
    const ArrowSolution solution = solve_at(about.scales.nuisance_sd, about, blocks, {}, std::vector<Index>{});
    return -0.5 * (solution.least + solution.log_volume_ratio);
  };
  const double here = log_of(fit);
  const auto& groups = likelihood.system().nuisance_groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto& values = groups[g].standard_deviations;
    const double now = fit.scales.nuisance_sd[static_cast<Index>(g)];
    const auto at = std::find(values.begin(), values.end(), now);
    if (at == values.end() || at == values.begin()) continue;
    for (const double less : std::set<double>{*std::prev(at), values.front()}) {
      LessSpread one{.fit = fit};
      one.fit.scales.nuisance_sd[static_cast<Index>(g)] = less;
      // Of the grid's prior: none as likely as all others together.
      const double to_none = less == values.front() ? std::log(static_cast<double>(values.size() - 1)) : 0.0;
      one.log_change = log_of(one.fit) - here + to_none;
      out.push_back(std::move(one));
    }
  }
  return out;
}

InstantPosterior instant_posterior(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                                   std::size_t r, std::size_t local) {
  const double duration_s = fit.layout.upper(local, r);
  const double at_s = fit.local[r][static_cast<Index>(local)];
  Residuals residuals;
  VectorXd values = fit.local[r];
  const auto chi2_at = [&](double value) {
    values[static_cast<Index>(local)] = value;
    if (!likelihood.evaluate(fit.layout, r, fit.shared, values, false, residuals))
      return std::numeric_limits<double>::infinity();
    if (curve) residuals.white -= curve.columns[r] * fit.curve_values;
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

std::pair<Fit, double> moved_to(const std::shared_ptr<const Likelihood>& likelihood, const Fit& from,
                                const Discrepancy& discrepancy) {
  const auto curve_of = [&](const Likelihood& by) { return discrepancy.columns(by, from.scales.curves); };
  const auto log_evidence = [&](const Fit& at, const CurveColumns& curve) {
    const auto blocks = linearise(*at.likelihood, at, curve);
    if (blocks.empty()) return -std::numeric_limits<double>::infinity();
    return at.likelihood->log_weights() - 0.5 * (at.cost + solve_about(at, blocks, curve).log_volume_ratio);
  };
  const CurveColumns curve = curve_of(*likelihood);
  Fit there = fit(*likelihood, from.layout, from.shared, from.local, from.scales, curve);
  there.likelihood = likelihood;
  if (!there.valid) return {std::move(there), -std::numeric_limits<double>::infinity()};
  const double change = log_evidence(there, curve) - log_evidence(from, curve_of(*from.likelihood));
  return {std::move(there), change};
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
  return out;
}

namespace {

// Of all curves of a scan together, each as likely beforehand: the likeliest's factor and what the rest adds to it.
struct Integrated {
  double log_factor = 0;
  double log_spread = 0;  // log_factor less the likeliest's own
};
Integrated integrated(const std::vector<CurveFactor>& curves) {
  std::vector<double> logs;
  for (const auto& one : curves) logs.push_back(one.log_bayes_factor);
  const double mean = log_sum(logs) - std::log(static_cast<double>(logs.size()));
  return {.log_factor = mean, .log_spread = mean - logs.front()};
}

// Every curve beside a fit, with what its set leaves open, by the noise that the curves were prepared with.
std::vector<CurveFactor> scan_beside(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit) {
  const auto by = with_inputs_of(fit, {std::shared_ptr<const void>(), &likelihood});  // not owned: no longer than here
  return discrepancy.scan(Marginal(*by, fit, discrepancy.columns(*by, fit.scales.curves), &likelihood));
}

// One more curve beside those that a set has; whether it is likelier than none more. log_evidence: with those it has.
bool add_curve(const Likelihood& likelihood, const Discrepancy& discrepancy, double log_prior_odds, Evaluated& out,
               double& log_evidence) {
  const Fit& here = *out.fit_with_curve;
  auto more = scan_beside(likelihood, discrepancy, here);
  for (const CurvePrior& known : here.scales.curves)
    std::erase_if(more, [&](const CurveFactor& one) { return one.prior.curve == known.curve; });
  if (more.empty()) return false;
  const Integrated all = integrated(more);
  if (all.log_factor + log_prior_odds < 0) return false;
  Scales scales = here.scales;
  scales.curves.push_back(more.front().prior);
  Settled with = settle(*here.likelihood, &discrepancy, here.layout, here.shared, here.local, scales,
                        nuisance_grid(likelihood.system()), -std::numeric_limits<double>::infinity());
  const double log_factor = with.over.log_mean + all.log_spread - log_evidence;
  if (!(log_factor + log_prior_odds > 0)) return false;
  log_evidence = with.over.log_mean;
  out.fit_with_curve = std::move(with.fit);
  out.nuisance_weights_with_curve = with.over.weights;
  out.log_factors.push_back(log_factor);
  return true;
}

// A curve to be fitted beside a set.
struct Candidate {
  CurvePrior prior;
  double log_spread = 0;  // Integrated
  VectorXd nuisance_sd;   // where the fit begins
};

// The likeliest beside the fit, and beside the same where insertions do not differ: what all recordings share looks
// like insertions that differ more, and then another curve than the one that it is may stand out of what is left.
std::vector<Candidate> candidates(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit,
                                  const std::vector<CurveFactor>& beside) {
  std::vector<Candidate> out;
  const auto add = [&](const std::vector<CurveFactor>& curves, const VectorXd& nuisance_sd) {
    if (curves.empty() || curves.front().log_bayes_factor < kLikelyCurve) return;
    const CurvePrior& prior = curves.front().prior;
    if (std::ranges::none_of(out, [&](const Candidate& known) { return known.prior.curve == prior.curve; }))
      out.push_back({.prior = prior, .log_spread = integrated(curves).log_spread, .nuisance_sd = nuisance_sd});
  };
  add(beside, fit.scales.nuisance_sd);
  if (fit.scales.nuisance_sd.cwiseAbs().sum() > 0) {
    Fit alike = fit;
    alike.scales.nuisance_sd.setZero();
    add(scan_beside(likelihood, discrepancy, alike), alike.scales.nuisance_sd);
  }
  return out;
}

}  // namespace

void add_discrepancy(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                     Evaluated& out) {
  out.with_discrepancy = true;
  out.curves = scan_beside(likelihood, discrepancy, out.fit);
  if (out.curves.empty()) return;
  out.log_bayes_factor_curve = integrated(out.curves).log_factor;
  // The likeliest, where the model is nonlinear: about the mode that it moves to; the rest of them by the linear model.
  Settled with{.fit = Fit(out.fit.layout), .over = {}};
  double log_spread = 0;
  for (const Candidate& one : candidates(likelihood, discrepancy, out.fit, out.curves)) {
    const Scales scales{.nuisance_sd = one.nuisance_sd, .curves = {one.prior}};
    Settled there = settle(*out.fit.likelihood, &discrepancy, out.fit.layout, out.fit.shared, out.fit.local, scales,
                           nuisance_grid(likelihood.system()), -std::numeric_limits<double>::infinity());
    if (!(there.over.log_mean + one.log_spread > with.over.log_mean + log_spread)) continue;
    with = std::move(there);
    log_spread = one.log_spread;
  }
  if (!std::isfinite(with.over.log_mean)) return;
  // Beside the curve another local minimum may have been found: it counts without the curve too.
  Settled again = settle(*with.fit.likelihood, nullptr, out.fit.layout, with.fit.shared, with.fit.local,
                         {.nuisance_sd = with.fit.scales.nuisance_sd, .curves = {}}, nuisance_grid(likelihood.system()),
                         out.log_evidence);
  if (again.over.log_mean > out.log_evidence) {
    out.fit = std::move(again.fit);
    out.log_evidence = again.over.log_mean;
    out.nuisance_weights = again.over.weights;
  }
  out.log_factors = {with.over.log_mean + log_spread - out.log_evidence};
  out.fit_with_curve = std::move(with.fit);
  out.nuisance_weights_with_curve = with.over.weights;
  double log_evidence = with.over.log_mean;
  while (out.log_factors.size() < rules.most &&
         add_curve(likelihood, discrepancy, rules.log_prior_odds_more, out, log_evidence)) {
  }
  // Over their number, each more with its prior odds.
  out.log_bayes_factor_curve = out.log_factors.back();
  for (std::size_t i = out.log_factors.size() - 1; i > 0; --i) {
    const double terms[] = {0, rules.log_prior_odds_more + out.log_bayes_factor_curve};
    out.log_bayes_factor_curve = out.log_factors[i - 1] + log_sum(terms);
  }
}

}  // namespace bevel::inference
