#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "diagnosis/inference/curved_fit.hpp"
#include "diagnosis/inference/evidence.hpp"
#include "diagnosis/inference/log_sum.hpp"
#include "diagnosis/inference/settle.hpp"

// The part of a set's evidence that a discrepancy has.
namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kLikelyCurve = 3;        // log Bayes factor from which a curve is fitted
constexpr double kOfLikeliest = 0.5;      // of what the likeliest curve gains: what that of another component does
constexpr double kWorthAnExchange = 0.5;  // log evidence: what a curve in another's place has to promise, and bring

// Of all curves of a scan together, each as likely beforehand: the likeliest's factor and what the rest adds to it.
struct Integrated {
  double log_factor = 0;
  double log_others = 0;  // what the others add to the likeliest's own: log_factor less that
};
Integrated integrated(const std::vector<CurveFactor>& curves) {
  std::vector<double> logs;
  for (const auto& one : curves) logs.push_back(one.log_bayes_factor);
  const double mean = log_sum(logs) - std::log(static_cast<double>(logs.size()));
  return {.log_factor = mean, .log_others = mean - logs.front()};
}

void erase_known(std::span<const CurvePrior> known, std::vector<CurveFactor>& curves) {
  std::erase_if(curves, [&](const CurveFactor& one) {
    return std::ranges::find(known, one.prior.curve, &CurvePrior::curve) != known.end();
  });
}

// Of those among a scan's curves that stand out nowhere: what they promise is little, and the linear model is right
// about it.
double log_factor_of_unlikely(const std::vector<CurveFactor>& curves) {
  std::vector<double> logs;
  for (const auto& one : curves)
    if (one.log_bayes_factor < kLikelyCurve) logs.push_back(one.log_bayes_factor);
  return log_sum(logs) - std::log(static_cast<double>(curves.size()));
}

// Every curve beside a fit, with what its set leaves open, by the noise that the curves were prepared with.
std::vector<CurveFactor> scan_beside(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit) {
  const auto by = with_inputs_of(fit, {std::shared_ptr<const void>(), &likelihood});  // not owned: no longer than here
  return discrepancy.scan(Marginal(*by, fit, discrepancy.columns(*by, fit), &likelihood));
}

// The same beside the fit with less spread, each way, with what that costs: what all recordings share looks like
// recordings that differ more, and then another curve than the one that it is may stand out of what is left. Where they
// do differ, no curve gains what spread does.
struct Scan {
  std::vector<CurveFactor> curves;
  double log_change = 0;
  double promised() const {
    return curves.empty() ? -std::numeric_limits<double>::infinity() : curves.front().log_bayes_factor + log_change;
  }
};
std::vector<Scan> scans_beside_less_spread(const Likelihood& likelihood, const Discrepancy& discrepancy,
                                           const Fit& fit) {
  std::vector<Scan> out;
  for (const WithLessSpread& less : with_less_spread(*fit.likelihood, fit, discrepancy.columns(*fit.likelihood, fit)))
    out.push_back({.curves = scan_beside(likelihood, discrepancy, less.fit), .log_change = less.log_change});
  return out;
}

// The curves that a set has so far: the log evidence with them, and Integrated::log_others of each.
struct Together {
  double log_evidence = 0;
  std::vector<double> log_others;
};

Settled settle_with_one_more(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& from,
                             const CurvePrior& prior) {
  Scales scales = from.scales;
  scales.curves.push_back(prior);
  std::shared_ptr<const CurveTangent> tangent;
  if (from.tangent) {
    Fit with_one_more = from;
    with_one_more.scales = scales;
    with_one_more.curve_values = VectorXd::Zero(discrepancy.places(scales.curves).back());
    with_one_more.curve_values.head(from.curve_values.size()) = from.curve_values;
    tangent = tangent_about(discrepancy, with_one_more);
  }
  return settle(*from.likelihood, &discrepancy, from.layout, from.shared, from.local, scales,
                nuisance_grid(likelihood.system()), -std::numeric_limits<double>::infinity(), std::move(tangent));
}

double log_factor_of(const std::vector<CurveFactor>& curves, const CurvePrior& prior) {
  const auto at = std::ranges::find(curves, prior, &CurveFactor::prior);
  return at == curves.end() ? -std::numeric_limits<double>::infinity() : at->log_bayes_factor;
}

// One more curve beside those that a set has; whether it is likelier than none more.
bool add_curve(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules, Evaluated& out,
               Together& so_far) {
  const Fit& here = *out.fit_with_curve;
  auto scans = scans_beside_less_spread(likelihood, discrepancy, here);
  scans.push_back({.curves = scan_beside(likelihood, discrepancy, here)});
  for (Scan& scan : scans) erase_known(here.scales.curves, scan.curves);
  const Scan &own = scans.back(), &more = *std::ranges::max_element(scans, {}, &Scan::promised);
  if (own.curves.empty() || more.curves.empty()) return false;  // outside the model's domain, or no other is left
  const Integrated all = integrated(more.curves);
  if (all.log_factor + more.log_change + rules.log_prior_odds_more + rules.optimism < 0) return false;
  const CurvePrior& prior = more.curves.front().prior;
  Settled with = settle_with_one_more(likelihood, discrepancy, here, prior);
  // Of the other scales and lengths, beside the spread that there is in the end.
  double log_others = all.log_others;
  if (with.fit.valid && with.fit.scales.nuisance_sd == here.scales.nuisance_sd)
    log_others = integrated(own.curves).log_factor - log_factor_of(own.curves, prior);
  const double log_factor = with.over.log_mean + log_others - so_far.log_evidence;
  if (!(log_factor + rules.log_prior_odds_more > 0)) return false;
  so_far.log_evidence = with.over.log_mean;
  so_far.log_others.push_back(log_others);
  out.fit_with_curve = std::move(with.fit);
  out.nuisance_weights_with_curve = with.over.weights;
  out.log_factors.push_back(log_factor);
  return true;
}

// The curves that are likeliest one after the other need not be those that are likeliest together: one of them in
// another's place, the others as they are; whether there was such a one.
bool exchange_curve(const Likelihood& likelihood, const Discrepancy& discrepancy, Evaluated& out, Together& so_far) {
  for (std::size_t k = 0; k < out.fit_with_curve->scales.curves.size(); ++k) {
    const CurvePrior leaves = out.fit_with_curve->scales.curves[k];
    const Fit rest = without_curve(discrepancy, *out.fit_with_curve, k);
    auto curves = scan_beside(likelihood, discrepancy, rest);
    erase_known(rest.scales.curves, curves);
    if (curves.empty() || curves.front().log_bayes_factor < log_factor_of(curves, leaves) + kWorthAnExchange) continue;
    Settled with = settle_with_one_more(likelihood, discrepancy, rest, curves.front().prior);
    if (!(with.over.log_mean > so_far.log_evidence + kWorthAnExchange)) continue;
    const double log_others = integrated(curves).log_others;
    out.log_factors.back() += with.over.log_mean + log_others - so_far.log_evidence - so_far.log_others[k];
    so_far.log_evidence = with.over.log_mean;
    so_far.log_others.erase(so_far.log_others.begin() + static_cast<std::ptrdiff_t>(k));
    so_far.log_others.push_back(log_others);
    out.fit_with_curve = std::move(with.fit);
    out.nuisance_weights_with_curve = with.over.weights;
    return true;
  }
  return false;
}

// A curve to be fitted beside a set.
struct Candidate {
  CurvePrior prior;
  double log_others = 0;                                      // Integrated
  const Fit* from;                                            // where the fit begins, its spread too
  double promised = std::numeric_limits<double>::infinity();  // log Bayes factor by the linear model about none
};

// The likeliest beside the fit, and beside the same with less spread. Each is fitted from the spread that there is:
// without it the noise takes what is left of that, and does not give it back.
std::vector<Candidate> candidates(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit,
                                  const std::vector<CurveFactor>& beside) {
  std::vector<Candidate> out;
  const auto add = [&](const std::vector<CurveFactor>& curves, double promised) {
    if (promised < kLikelyCurve) return;
    const CurvePrior& prior = curves.front().prior;
    const auto known = std::ranges::find(out, prior.curve, [](const Candidate& c) { return c.prior.curve; });
    if (known != out.end() && known->promised >= promised) return;
    if (known != out.end()) out.erase(known);
    out.push_back({.prior = prior, .log_others = integrated(curves).log_others, .from = &fit, .promised = promised});
  };
  add(beside, beside.front().log_bayes_factor);
  for (const Scan& scan : scans_beside_less_spread(likelihood, discrepancy, fit)) add(scan.curves, scan.promised());
  std::ranges::stable_sort(out, std::greater{}, &Candidate::promised);
  return out;
}

// The likeliest of each component but those that are known, where the linear model about none, which is wrong here,
// does not say much less of it than of the likeliest.
std::vector<CurvePrior> of_other_components(const System& system, const std::vector<CurveFactor>& curves,
                                            const std::vector<Candidate>& known) {
  const auto component = [&](std::size_t curve) { return system.curves()[curve].component; };
  std::vector<CurvePrior> out;
  const auto has = [&](const CurvePrior& prior) {
    return [&](const auto& one) { return component(one) == component(prior.curve); };
  };
  for (const CurveFactor& one : curves) {
    if (one.log_bayes_factor < std::max(kLikelyCurve, kOfLikeliest * curves.front().log_bayes_factor)) break;
    if (std::ranges::none_of(known, has(one.prior), [](const Candidate& c) { return c.prior.curve; }) &&
        std::ranges::none_of(out, has(one.prior), &CurvePrior::curve))
      out.push_back(one.prior);
  }
  return out;
}

// One curve beside a set, where the model is nonlinear: about the mode that it moves to.
struct WithCurve {
  Settled settled;
  double log_others = 0;  // of the scales and lengths, and the other curves, that were not fitted
  double log_evidence() const { return settled.over.log_mean + log_others; }
};

WithCurve settle_with(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& set,
                      const Candidate& one, std::size_t choices, double give_up_below) {
  const Fit& from = *one.from;
  std::shared_ptr<const CurveTangent> tangent;
  if (from.curve_values.size() > 0) tangent = tangent_about(discrepancy, from);
  const Scales scales{.nuisance_sd = from.scales.nuisance_sd, .curves = {one.prior}};
  const Likelihood& by = from.likelihood ? *from.likelihood : *set.likelihood;
  WithCurve out{.settled = settle(by, &discrepancy, set.layout, from.shared, from.local, scales,
                                  nuisance_grid(likelihood.system()), give_up_below, std::move(tangent)),
                .log_others = one.log_others};
  const Fit& fit = out.settled.fit;
  // What the linear model about none says of the others is nothing where that is not what this one is.
  if (fit.valid && fit.tangent) {
    const VectorXd own = log_over_priors(discrepancy, fit, discrepancy.columns(*fit.likelihood, fit), 0);
    out.log_others = log_sum(std::span<const double>(own.data(), static_cast<std::size_t>(own.size()))) -
                     std::log(static_cast<double>(choices));
  }
  return out;
}

}  // namespace

double log_factor_of_one_more(const Discrepancy& discrepancy, const Marginal& beside,
                              std::span<const CurvePrior> known) {
  auto curves = discrepancy.scan(beside);
  erase_known(known, curves);
  return curves.empty() ? 0 : integrated(curves).log_factor;
}

Fit without_curve(const Discrepancy& discrepancy, Fit fit, std::size_t which) {
  const auto places = discrepancy.places(fit.scales.curves);
  const Index after = fit.curve_values.size() - places[which + 1];
  fit.curve_values.segment(places[which], after) = fit.curve_values.tail(after).eval();
  fit.curve_values.conservativeResize(places[which] + after);
  fit.scales.curves.erase(fit.scales.curves.begin() + static_cast<std::ptrdiff_t>(which));
  if (fit.tangent) fit.tangent = fit.scales.curves.empty() ? nullptr : tangent_about(discrepancy, fit);
  return fit;
}

Fit with_first_curve(const Discrepancy& discrepancy, Fit fit) {
  fit.curve_values.conservativeResize(discrepancy.places(fit.scales.curves)[1]);
  fit.scales.curves.resize(1);
  fit.tangent = nullptr;
  return fit;
}

void add_discrepancy(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                     Evaluated& out, double give_up_below, const LargeCurves& large) {
  out.with_discrepancy = true;
  out.curves = scan_beside(likelihood, discrepancy, out.fit);
  if (out.curves.empty()) return;
  out.log_bayes_factor_curve = log_factor_of_unlikely(out.curves);
  // Where none stands out, a fit that comes to less was given up, or is in another local minimum.
  const bool stands_out = out.curves.front().log_bayes_factor >= kLikelyCurve;
  const double least =
      stands_out ? -std::numeric_limits<double>::infinity() : out.log_evidence + out.log_bayes_factor_curve;
  // The likeliest, where the model is nonlinear: about the mode that it moves to; the rest of them by the linear model.
  std::vector<Candidate> list;
  if (large.beside)
    list.push_back({.prior = large.beside->scales.curves.front(),
                    .log_others = integrated(out.curves).log_others,
                    .from = large.beside});
  for (Candidate& one : candidates(likelihood, discrepancy, out.fit, out.curves)) list.push_back(std::move(one));
  WithCurve best{.settled = {.fit = Fit(out.fit.layout), .over = {}}};
  bool is_large = false;
  const auto try_all = [&](const std::vector<Candidate>& some) {
    for (const Candidate& one : some) {
      if (out.log_evidence + one.promised + one.log_others < best.log_evidence()) continue;
      WithCurve there = settle_with(likelihood, discrepancy, out.fit, one, out.curves.size(), give_up_below);
      is_large = is_large || there.settled.fit.tangent;
      if (there.log_evidence() > best.log_evidence()) best = std::move(there);
    }
  };
  try_all(list);
  if (large.every_component && is_large) {
    std::vector<Candidate> others;
    for (const CurvePrior& prior : of_other_components(likelihood.system(), out.curves, list))
      others.push_back(
          {.prior = prior, .log_others = -std::log(static_cast<double>(out.curves.size())), .from = &out.fit});
    try_all(others);
  }
  Settled& with = best.settled;
  const double log_others = best.log_others;
  if (!(with.over.log_mean + log_others > least)) return;
  // Beside the curve another local minimum may have been found: it counts without the curve too.
  Settled again = settle(*with.fit.likelihood, nullptr, out.fit.layout, with.fit.shared, with.fit.local,
                         {.nuisance_sd = with.fit.scales.nuisance_sd, .curves = {}}, nuisance_grid(likelihood.system()),
                         out.log_evidence);
  if (again.over.log_mean > out.log_evidence) {
    out.fit = std::move(again.fit);
    out.log_evidence = again.over.log_mean;
    out.nuisance_weights = again.over.weights;
  }
  out.log_factors = {with.over.log_mean + log_others - out.log_evidence};
  out.fit_with_curve = std::move(with.fit);
  out.nuisance_weights_with_curve = with.over.weights;
  Together so_far{.log_evidence = with.over.log_mean, .log_others = {log_others}};
  while (so_far.log_evidence > give_up_below && out.log_factors.size() < rules.most &&
         add_curve(likelihood, discrepancy, rules, out, so_far)) {
    while (exchange_curve(likelihood, discrepancy, out, so_far)) {
    }
  }
  // Over their number, each more with its prior odds.
  out.log_bayes_factor_curve = out.log_factors.back();
  for (std::size_t i = out.log_factors.size() - 1; i > 0; --i) {
    const double terms[] = {0, rules.log_prior_odds_more + out.log_bayes_factor_curve};
    out.log_bayes_factor_curve = out.log_factors[i - 1] + log_sum(terms);
  }
}

}  // namespace bevel::inference
