// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/diagnosis/inference/curved_fit.hpp>
#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/inference/settle.hpp>
#include <bevel/diagnosis/parallel.hpp>

// The part of a set's evidence that a discrepancy has.
namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kNever = -std::numeric_limits<double>::infinity();  // log evidence below which a fit is given up
constexpr double kLikelyCurve = 3;                                   // log Bayes factor from which a curve is fitted
constexpr double kOfLikeliest = 0.5;      // of what the likeliest curve gains: what that of another component does
constexpr double kWorthAnExchange = 0.5;  // log evidence: what a curve in another's place has to promise, and bring

// What all choices together add to the evidence of one that was fitted, each as likely beforehand, by the linear model:
// another counts for no more than that one, whatever it promises. What it would come to was not looked at, or was, and
// it is less.
double log_others(std::span<const double> logs, double log_fitted, std::size_t choices) {
  std::vector<double> kept;
  for (const double log : logs) kept.push_back(std::min(log - log_fitted, 0.0));
  return log_sum(kept) - std::log(static_cast<double>(choices));
}

std::vector<double> log_factors_of(const std::vector<CurveFactor>& curves) {
  std::vector<double> logs;
  for (const auto& one : curves) logs.push_back(one.log_bayes_factor);
  return logs;
}

// Of all curves of a scan together, each as likely beforehand: the likeliest's factor and what the rest adds to it.
struct Integrated {
  double log_factor = 0;
  double log_others = 0;  // what the others add to the likeliest's own: log_factor less that
};
Integrated integrated(const std::vector<CurveFactor>& curves) {
  const auto logs = log_factors_of(curves);
  const double others = log_others(logs, logs.front(), logs.size());
  return {.log_factor = logs.front() + others, .log_others = others};
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

// By the noise that the curves were prepared with, with what a fit's set leaves open. Not owned: for no longer than
// `likelihood` lives.
std::shared_ptr<const Likelihood> as_prepared(const Likelihood& likelihood, const Fit& fit) {
  return with_inputs_of(fit, {std::shared_ptr<const void>(), &likelihood});
}

// Every curve but those that it has beside a fit.
std::vector<CurveFactor> scan_beside(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit) {
  const auto by = as_prepared(likelihood, fit);
  auto curves = discrepancy.scan(Marginal(*by, fit, discrepancy.columns(*by, fit), &likelihood));
  erase_known(fit.scales.curves, curves);
  return curves;
}

// The same beside the fit with less spread, each way, with what that costs: what all recordings share looks like
// recordings that differ more, and then another curve than the one that it is may stand out of what is left. Where they
// do differ, no curve gains what spread does.
struct Scan {
  std::vector<CurveFactor> curves{};
  WithLessSpread beside;
  bool at_mode = false;
  double promised() const {
    return curves.empty() ? -std::numeric_limits<double>::infinity()
                          : curves.front().log_bayes_factor + beside.log_change;
  }
};
std::vector<Scan> scans_beside_less_spread(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit,
                                           const CurveColumns& curve) {
  std::vector<Scan> out;
  for (WithLessSpread& less : with_less_spread(*fit.likelihood, fit, curve)) {
    auto curves = scan_beside(likelihood, discrepancy, less.fit);
    out.push_back({.curves = std::move(curves), .beside = std::move(less)});
  }
  return out;
}

// Which of them promises most, once that has been looked at about its mode; end: none promises as much as `least`.
std::vector<Scan>::iterator most_promising(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit,
                                           const CurveColumns& curve, double least, std::vector<Scan>& scans) {
  for (;;) {
    const auto most = std::ranges::max_element(scans, {}, &Scan::promised);
    if (most == scans.end() || most->promised() < least) return scans.end();
    if (most->at_mode) return most;
    most->beside = at_its_mode(most->beside, fit, curve);
    most->curves = scan_beside(likelihood, discrepancy, most->beside.fit);
    most->at_mode = true;
  }
}

// The curves that a set has so far: the log evidence with them, and Integrated::log_others of each.
struct Together {
  double log_evidence = 0;
  std::vector<double> log_others;
};

Settled settle_with_one_more(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& from,
                             const CurvePrior& prior, double give_up_below) {
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
                nuisance_grid(likelihood.system()), give_up_below, std::move(tangent));
}

double log_factor_of(const std::vector<CurveFactor>& curves, const CurvePrior& prior) {
  const auto at = std::ranges::find(curves, prior, &CurveFactor::prior);
  return at == curves.end() ? -std::numeric_limits<double>::infinity() : at->log_bayes_factor;
}

// Whether a fit stays hopeless with all that is promised of one more curve by the noise that the curves were prepared
// with. By a noise that is much smaller than the fit's own every curve promises much, and leaves more undone.
bool stays_hopeless(const Likelihood& likelihood, const Discrepancy& discrepancy, const Fit& fit, double log_evidence,
                    double promised, double hopeless) {
  if (log_evidence + kMostOfPromise * promised < hopeless) return true;
  if (!(log_evidence < hopeless)) return false;
  const Moved moved = moved_to(as_prepared(likelihood, fit), fit, discrepancy);
  return moved.fit.valid && log_evidence + kMostOfPromise * moved.log_gain(promised) < hopeless;
}

// What the other scales and lengths of one of a fit's curves add to the evidence of those that it has, about its mode.
double log_others_about(const Discrepancy& discrepancy, const Fit& fit, std::size_t which, std::size_t choices) {
  const VectorXd logs = log_over_priors(discrepancy, fit, discrepancy.columns(*fit.likelihood, fit), which);
  return log_others(std::span<const double>(logs.data(), static_cast<std::size_t>(logs.size())), 0, choices);
}

// With one more curve, where that is likelier than none more; whether it is.
bool take_if_likelier(const CurveRules& rules, Settled with, double log_others, Evaluated& out, Together& so_far) {
  const double log_factor = with.over.log_mean + log_others - so_far.log_evidence;
  if (!(log_factor + rules.log_prior_odds_more > 0)) return false;
  so_far.log_evidence = with.over.log_mean;
  so_far.log_others.push_back(log_others);
  out.fit_with_curve = std::move(with.fit);
  out.nuisance_weights_with_curve = std::move(with.over.weights);
  out.log_factors.push_back(log_factor);
  return true;
}

// The next curve that another set's fit has, all as they are there: from one alone the others need not be found.
// Whether it is likelier than none more.
bool add_curve_of(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                  const Fit& other, Evaluated& out, Together& so_far) {
  const std::size_t count = out.log_factors.size() + 1;
  if (other.scales.curves.size() < count) return false;
  const Fit from = with_first_curves(discrepancy, other, count);
  Settled with =
      settle(*from.likelihood, &discrepancy, out.fit.layout, from.shared, from.local, from.scales,
             nuisance_grid(likelihood.system()), so_far.log_evidence - rules.log_prior_odds_more - rules.optimism,
             tangent_about(discrepancy, from));
  if (!with.fit.valid) return false;
  auto rest = out.curves;
  erase_known(std::span(from.scales.curves).first(count - 1), rest);
  const double others = log_others_about(discrepancy, with.fit, count - 1, rest.size());
  return take_if_likelier(rules, std::move(with), others, out, so_far);
}

// One more curve beside those that a set has; whether it is likelier than none more.
bool add_curve(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules, double hopeless,
               Evaluated& out, Together& so_far) {
  const Fit& here = *out.fit_with_curve;
  const CurveColumns curve = discrepancy.columns(*here.likelihood, here);
  auto scans = scans_beside_less_spread(likelihood, discrepancy, here, curve);
  scans.push_back({.curves = scan_beside(likelihood, discrepancy, here), .beside = {.fit = here}, .at_mode = true});
  const std::vector<CurveFactor>& own = scans.back().curves;
  if (own.empty()) return false;  // outside the model's domain, or no other is left
  const double least = -rules.log_prior_odds_more - rules.optimism;
  const auto more = most_promising(likelihood, discrepancy, here, curve, least, scans);
  if (more == scans.end()) return false;
  const Integrated all = integrated(more->curves);
  const double promised = all.log_factor + more->beside.log_change;
  if (promised < least || stays_hopeless(likelihood, discrepancy, here, so_far.log_evidence, promised, hopeless))
    return false;
  const CurvePrior& prior = more->curves.front().prior;
  const double no_likelier = so_far.log_evidence - rules.log_prior_odds_more - all.log_others;
  Settled with = settle_with_one_more(likelihood, discrepancy, here, prior, no_likelier - rules.optimism);
  // Of the other scales and lengths, beside the spread that there is in the end.
  double others = all.log_others;
  if (with.fit.valid && with.fit.scales.nuisance_sd == here.scales.nuisance_sd)
    others = log_others(log_factors_of(own), log_factor_of(own, prior), own.size());
  return take_if_likelier(rules, std::move(with), others, out, so_far);
}

// The curves that are likeliest one after the other need not be those that are likeliest together: one of them in
// another's place, the others as they are; whether there was such a one.
bool exchange_curve(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                    Evaluated& out, Together& so_far) {
  for (std::size_t k = 0; k < out.fit_with_curve->scales.curves.size(); ++k) {
    const CurvePrior leaves = out.fit_with_curve->scales.curves[k];
    const Fit rest = without_curve(discrepancy, *out.fit_with_curve, k);
    const auto curves = scan_beside(likelihood, discrepancy, rest);
    if (curves.empty() || curves.front().log_bayes_factor < log_factor_of(curves, leaves) + kWorthAnExchange) continue;
    Settled with = settle_with_one_more(likelihood, discrepancy, rest, curves.front().prior,
                                        so_far.log_evidence + kWorthAnExchange - rules.optimism);
    if (!(with.over.log_mean > so_far.log_evidence + kWorthAnExchange)) continue;
    const double others = integrated(curves).log_others;
    out.log_factors.back() += with.over.log_mean + others - so_far.log_evidence - so_far.log_others[k];
    so_far.log_evidence = with.over.log_mean;
    so_far.log_others.erase(so_far.log_others.begin() + static_cast<std::ptrdiff_t>(k));
    so_far.log_others.push_back(others);
    out.fit_with_curve = std::move(with.fit);
    out.nuisance_weights_with_curve = with.over.weights;
    return true;
  }
  return false;
}

// A curve to be fitted beside a set.
struct Candidate {
  CurvePrior prior;
  double log_others = 0;  // Integrated
  const Fit* from;        // where the fit begins, its spread too
};

// The likeliest of each component but those that are known, where the linear model about none, which is wrong here,
// does not say much less of it than of the likeliest.
std::vector<CurvePrior> of_other_components(const System& system, const std::vector<CurveFactor>& curves,
                                            const std::vector<CurvePrior>& known) {
  const auto component = [&](std::size_t curve) { return system.curves()[curve].component; };
  std::vector<CurvePrior> out;
  const auto has = [&](const CurvePrior& prior) {
    return [&](const CurvePrior& one) { return component(one.curve) == component(prior.curve); };
  };
  for (const CurveFactor& one : curves) {
    if (one.log_bayes_factor < std::max(kLikelyCurve, kOfLikeliest * curves.front().log_bayes_factor)) break;
    if (std::ranges::none_of(known, has(one.prior)) && std::ranges::none_of(out, has(one.prior)))
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
  if (fit.valid && fit.tangent) out.log_others = log_others_about(discrepancy, fit, 0, choices);
  return out;
}

// From the likeliest first curve on: the next beside it, for as long as one more is likelier than not.
void begin_with(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules, WithCurve first,
                const CurveStart& start, Evaluated& out) {
  Settled& with = first.settled;
  out.log_factors = {first.log_evidence() - out.log_evidence};
  Together so_far{.log_evidence = with.over.log_mean, .log_others = {first.log_others}};
  out.fit_with_curve = std::move(with.fit);
  out.nuisance_weights_with_curve = std::move(with.over.weights);
  const auto add_one = [&] {
    return (start.large_curve && add_curve_of(likelihood, discrepancy, rules, *start.large_curve, out, so_far)) ||
           add_curve(likelihood, discrepancy, rules, start.hopeless_below, out, so_far);
  };
  while (out.log_factors.size() < rules.most && add_one()) {
    while (exchange_curve(likelihood, discrepancy, rules, out, so_far)) {
    }
  }
  // Over their number, each more with its prior odds.
  out.log_bayes_factor_curve = out.log_factors.back();
  for (std::size_t i = out.log_factors.size() - 1; i > 0; --i) {
    const double terms[] = {0, rules.log_prior_odds_more + out.log_bayes_factor_curve};
    out.log_bayes_factor_curve = out.log_factors[i - 1] + log_sum(terms);
  }
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

Fit with_first_curves(const Discrepancy& discrepancy, Fit fit, std::size_t count) {
  fit.curve_values.conservativeResize(discrepancy.places(fit.scales.curves)[count]);
  fit.scales.curves.resize(count);
  fit.tangent = nullptr;
  return fit;
}

void add_discrepancy(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                     Evaluated& out, const CurveStart& start) {
  const Fit* const large_curve = start.large_curve;
  const double give_up_below = start.promised_with_several ? kNever : start.hopeless_below;
  out.with_discrepancy = true;
  out.curves = scan_beside(likelihood, discrepancy, out.fit);
  out.discrepancy_known = out.curves.empty();
  if (out.curves.empty()) return;
  out.log_bayes_factor_curve = log_factor_of_unlikely(out.curves);
  // Where none stands out, a fit that comes to less was given up, or is in another local minimum.
  const bool stands_out = out.curves.front().log_bayes_factor >= kLikelyCurve;
  const double least =
      stands_out ? -std::numeric_limits<double>::infinity() : out.log_evidence + out.log_bayes_factor_curve;
  // The likeliest, where the model is nonlinear: about the mode that it moves to; the rest of them by the linear model.
  // Of those that were tried a large one had its scale and length fitted too.
  std::vector<CurvePrior> tried, refined;
  WithCurve best{.settled = {.fit = Fit(out.fit.layout), .over = {}}};
  const auto try_one = [&](const Candidate& one) {
    WithCurve there = settle_with(likelihood, discrepancy, out.fit, one, out.curves.size(), give_up_below);
    (there.settled.fit.tangent ? refined : tried).push_back(one.prior);
    if (there.log_evidence() > best.log_evidence()) best = std::move(there);
  };
  const double others = integrated(out.curves).log_others;
  if (large_curve) {
    const Fit first = with_first_curves(discrepancy, *large_curve, 1);
    try_one({.prior = first.scales.curves.front(), .log_others = others, .from = &first});
    // What was promised was promised beside that one.
    if (best.log_evidence() < give_up_below) return;
  }
  if (stands_out && out.log_evidence + out.curves.front().log_bayes_factor + others > best.log_evidence())
    try_one({.prior = out.curves.front().prior, .log_others = others, .from = &out.fit});
  // And beside less spread, where that promises more. Fitted from the spread that there is: without it the noise takes
  // what is left of that, and does not give it back.
  const CurveColumns none;
  auto scans = scans_beside_less_spread(likelihood, discrepancy, out.fit, none);
  for (;;) {
    const double no_less = std::max(kLikelyCurve, best.log_evidence() - out.log_evidence);
    const auto more = most_promising(likelihood, discrepancy, out.fit, none, no_less, scans);
    if (more == scans.end()) break;
    const Candidate one{
        .prior = more->curves.front().prior, .log_others = integrated(more->curves).log_others, .from = &out.fit};
    const bool promises_more = out.log_evidence + more->promised() + one.log_others > best.log_evidence();
    scans.erase(more);
    if (promises_more && std::ranges::count(tried, one.prior) == 0 &&
        std::ranges::count(refined, one.prior.curve, &CurvePrior::curve) == 0)
      try_one(one);
  }
  const bool is_at_mode = best.log_evidence() > least && !(best.log_evidence() < give_up_below);
  if (best.log_evidence() > least) begin_with(likelihood, discrepancy, rules, std::move(best), start, out);
  out.discrepancy_known = is_at_mode || !stands_out;
}

void add_large_curves(const Likelihood& likelihood, const Discrepancy& discrepancy, const CurveRules& rules,
                      Evaluated& out) {
  if (!out.fit_with_curve || !out.fit_with_curve->tangent) return;
  std::vector<CurvePrior> known = out.fit_with_curve->scales.curves;
  known.push_back(out.curves.front().prior);
  const auto priors = of_other_components(likelihood.system(), out.curves, known);
  std::vector<WithCurve> there(priors.size(), {.settled = {.fit = Fit(out.fit.layout), .over = {}}});
  parallel_for(priors.size(), [&](std::size_t i) {
    const Candidate one{
        .prior = priors[i], .log_others = -std::log(static_cast<double>(out.curves.size())), .from = &out.fit};
    there[i] = settle_with(likelihood, discrepancy, out.fit, one, out.curves.size(), kNever);
  });
  const auto best = std::ranges::max_element(there, {}, &WithCurve::log_evidence);
  if (best != there.end() && best->log_evidence() > out.log_evidence + out.log_factors.front())
    begin_with(likelihood, discrepancy, rules, std::move(*best), {}, out);
}

}  // namespace bevel::inference
