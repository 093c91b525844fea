// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/found_effects.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include <bevel/diagnosis/inference/nuisances.hpp>
#include <bevel/diagnosis/mismatch/moved_tip.hpp>
#include <bevel/diagnosis/statistics/quantiles.hpp>
#include "inference/instant_posterior.hpp"

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::Fit;
using inference::ModelSet;
using inference::Search;

namespace {

FoundParameter shared_parameter(const NeedleSystem& system, const inference::Unknowns& unknowns,
                                const ChosenModel& model, std::size_t member, std::size_t p) {
  const auto& layout = model.fit->layout;
  const int at = layout.find_shared(member, p);
  const inference::Parameter& parameter = *layout.shared()[static_cast<std::size_t>(at)].parameter;
  FoundParameter out{.name = parameter.name, .value = model.fit->shared[at], .none = parameter.none};
  const auto mixture = unknowns.of(static_cast<int>(layout.set()[member]), p);
  const double off = mixture.mean() - out.value;
  out.std_error = std::sqrt(mixture.sd() * mixture.sd() + off * off);
  out.ci95 = {std::min(mixture.quantile(0.025), out.value), std::max(mixture.quantile(0.975), out.value)};
  // What the form adds is no part of the readings' own evidence.
  const model::EffectParameter& form = system.parameter(layout.set()[member], p);
  if (const double form_sd = std::hypot(form.form_sd, form.form_share * out.value); form_sd > 0) {
    out.std_error = std::hypot(out.std_error, form_sd);
    out.ci95 = {out.value - std::hypot(out.value - out.ci95[0], k95 * form_sd),
                out.value + std::hypot(out.ci95[1] - out.value, k95 * form_sd)};
  }
  if (!parameter.periodic)
    for (double& end : out.ci95) end = std::clamp(end, parameter.lower, parameter.upper);
  // The same but for whole turns: the one that is meant.
  const double turned = model::meant(form, out.value) - out.value;
  out.value += turned;
  for (double& end : out.ci95) end += turned;
  const auto& held = model.fit->held;
  const double fitted = model.fit->shared[at];
  const bool at_end =
      !parameter.periodic && fitted != parameter.none && (fitted <= parameter.lower || fitted >= parameter.upper);
  out.at_bound = at_end || std::find(held.begin(), held.end(), at) != held.end();
  return out;
}

// Its phase or instant in one recording; false where it did not happen.
bool local_parameter(const ChosenModel& model, std::size_t r, int at, const VectorXd& variances, double frame_s,
                     FoundParameter& out) {
  const Fit& fit = *model.fit;
  const auto i = static_cast<std::size_t>(at);
  out.name = fit.layout.local()[i].parameter->name;
  out.value = fit.local[r][at];
  const bool instant = fit.layout.is_instant(i);
  if (instant && !(out.value > 0)) return false;
  // Between two readings nothing is seen: where in a frame it happened is known only by its assumed form.
  const double between_s = instant ? frame_s / std::sqrt(12.0) : 0;
  if (!fit.layout.is_fitted(i)) {
    const auto posterior = instant_posterior(*fit.likelihood, fit, model.curve, r, i);
    out.std_error = std::hypot(posterior.sd_s, between_s);
    out.ci95 = {std::min(posterior.low_s, out.value - k95 * between_s),
                std::max(posterior.high_s, out.value + k95 * between_s)};
    return true;
  }
  const auto free = free_locals(fit.layout);
  const auto place = std::find(free.begin(), free.end(), at) - free.begin();
  out.std_error = std::hypot(std::sqrt(std::max(0.0, variances[place])), between_s);
  out.ci95 = {out.value - k95 * out.std_error, out.value + k95 * out.std_error};
  if (instant)
    for (double& end : out.ci95) end = std::clamp(end, 0.0, fit.layout.upper(i, r));
  return true;
}

// A candidate model at its mode: evaluated again where the search gave it up before, and with a discrepancy if asked.
// `like` is a larger model's fit, from which an evaluation begins.
inference::Visited at_mode(const Search& search, const ModelSet& set, const Fit& like, bool with_discrepancy) {
  const auto known = search.visited().find(set);
  std::shared_ptr<const inference::Evaluated> at = known == search.visited().end() ? nullptr : known->second.at;
  const Fit from = carried_to(inference::Layout(search.system(), set), like);
  if (!at || at->given_up)
    at = std::make_shared<const inference::Evaluated>(
        evaluate(search.likelihood(), from.layout, from.shared, from.local, from.scales.nuisance_sd));
  if (at->valid && with_discrepancy && !at->discrepancy_known) {
    auto more = std::make_shared<inference::Evaluated>(*at);
    add_discrepancy(search.likelihood(), search.discrepancy(), search.curve_rules(), *more);
    at = std::move(more);
  }
  return search.weighed(set, search.log_prior(set), at);
}

// Null: the model without the member cannot follow the recordings.
std::optional<double> log_bayes_factor_of(const Search& search, const ChosenModel& model, std::size_t member) {
  const Fit& fit = *model.fit;
  const ModelSet& set = fit.layout.set();
  const bool with_discrepancy = !fit.scales.curves.empty();
  const auto& here = search.visited().at(set);
  const auto rest = at_mode(search, inference::without(set, set[member]), fit, with_discrepancy);
  if (!rest.at->valid) return std::nullopt;
  const double odds = search.log_prior_odds(set[member]);
  return with_discrepancy ? here.log_with_curve - rest.log_with_curve - odds
                          : here.log_without_curve - rest.log_without_curve - odds;
}

// Borrows `discrepancy`.
ModelledTip tip_of(const ChosenModel& model, std::span<const inference::CurveValues> discrepancy) {
  const Fit& fit = *model.fit;
  return {.layout = &fit.layout, .shared = &fit.shared, .local = &fit.local, .discrepancy = discrepancy};
}

}  // namespace

std::vector<FoundEffect> found_effects(const NeedleSystem& system, const Search& search,
                                       const inference::Posterior& posterior, const inference::Unknowns& unknowns,
                                       const ChosenModel& model) {
  std::vector<FoundEffect> out;
  const Fit& fit = *model.fit;
  const ModelSet& set = fit.layout.set();
  const auto solution = solve_about(fit, model.blocks, model.curve);
  const ModelledTip tip = tip_of(model, model.discrepancy);
  for (std::size_t m = 0; m < set.size(); ++m) {
    const inference::Effect& effect = system.effects()[set[m]];
    FoundEffect found{.name = effect.name,
                      .meaning = std::string(system.physics(set[m]).meaning()),
                      .probability = std::min(1.0, posterior.inclusion.at(effect.name)),
                      .joint_probability = joint_probability(search, posterior, set, set[m]),
                      .ambiguous_with = confounders_of(search, posterior, set, set[m])};
    for (std::size_t p = 0; p < effect.parameters.size(); ++p)
      if (effect.parameters[p].scope == inference::Scope::shared)
        found.parameters.push_back(shared_parameter(system, unknowns, model, m, p));
    for (std::size_t r = 0; r < fit.local.size(); ++r) {
      FoundInRecording one{.log = system.recorded().recordings[r].name, .parameters = {}};
      const VectorXd variances = local_variances(model.blocks[r], solution);
      for (std::size_t p = 0; p < effect.parameters.size(); ++p)
        if (const int at = fit.layout.find_local(m, p); at >= 0)
          if (FoundParameter own; local_parameter(model, r, at, variances, system.data().frame_s, own))
            one.parameters.push_back(own);
      if (!one.parameters.empty()) found.recordings.push_back(std::move(one));
    }
    // Without it, by the same noise.
    const ModelSet rest = inference::without(set, set[m]);
    const inference::Layout smaller(system, rest);
    std::vector<VectorXd> local;
    for (const auto& own : fit.local) local.push_back(smaller.local_from(fit.layout, own));
    const Fit less = inference::fit(*fit.likelihood, smaller, smaller.shared_from(fit.layout, fit.shared), local,
                                    fit.scales, model.curve);
    found.visible_sigmas = std::sqrt(std::max(0.0, less.cost - fit.cost));
    found.log_bayes_factor = log_bayes_factor_of(search, model, m).value_or(std::numeric_limits<double>::infinity());
    found.moved_at_depth_mm = moved_by_member_mm(system, tip, m);
    out.push_back(std::move(found));
  }
  return out;
}

std::string fault_of_name(const NeedleSystem& system, const Search& search, const inference::Unknowns& unknowns,
                          const ChosenModel& model, std::size_t member) {
  const auto& parameters = system.effects()[model.fit->layout.set()[member]].parameters;
  bool has_size = false, shown = false;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    if (parameters[p].scope != inference::Scope::shared || std::isnan(parameters[p].none)) continue;
    has_size = true;
    shown = shown || excludes_none(shared_parameter(system, unknowns, model, member, p));
  }
  if (has_size && !shown) return "the 95 % interval of its size includes no effect";
  const auto factor = log_bayes_factor_of(search, model, member);
  return factor && !(*factor > 0) ? "its log Bayes factor is not positive" : "";
}

namespace {

// Computes, for each effect, the log Bayes factor if its estimate is exactly "no effect": the density of the size prior
// there against the standard error of the size. A fit that comes to less is in a local minimum, as "no effect" is a
// special case of every effect.
std::vector<double> least_log_factors(const Search& search) {
  std::vector<double> out(search.system().effects().size(), 0);
  for (const auto& size : search.proposals().reach(search.base_marginal()).sizes) {
    const inference::Parameter& p = search.system().effects()[size.effect].parameters[size.parameter];
    const double sd = size.one_deviation;
    if (!std::isfinite(sd)) continue;
    out[size.effect] +=
        std::min(0.0, log_density(p.prior, p.none, sd) + std::log(sd) + 0.5 * std::log(2 * std::numbers::pi));
  }
  return out;
}

}  // namespace

std::vector<TriedEffect> tried_beside(const Search& search, const ModelSet& set, bool with_discrepancy) {
  std::vector<TriedEffect> out;
  const auto& effects = search.system().effects();
  const auto& from = search.visited().at(set);
  const auto least = least_log_factors(search);
  const auto is_known = [](const inference::Visited& one, bool with) {
    return with ? one.at->discrepancy_known : !one.at->given_up;
  };
  for (std::size_t e = 0; e < effects.size(); ++e) {
    const ModelSet larger = inference::with(set, e);
    if (inference::contains(set, e) || !search.system().allows(larger)) continue;
    const double odds = search.log_prior_odds(e);
    TriedEffect one{.name = effects[e].label, .beside = set.empty() ? "" : describe(search.system(), set)};
    if (const auto at = search.visited().find(larger); at != search.visited().end()) {
      one.fitted = true;
      one.with_discrepancy = with_discrepancy && is_known(from, true) && is_known(at->second, true);
      if (one.with_discrepancy)
        one.log_bayes_factor = at->second.log_with_curve - from.log_with_curve - odds;
      else if (is_known(from, false) && is_known(at->second, false))
        one.log_bayes_factor = at->second.log_without_curve - from.log_without_curve - odds;
      // The tolerance of a prediction by the linear model against a fit: the noise is estimated again.
      if (one.log_bayes_factor && *one.log_bayes_factor < least[e] - search.rules().optimism)
        one.log_bayes_factor.reset();
      const Fit& fit =
          one.with_discrepancy && at->second.at->fit_with_curve ? *at->second.at->fit_with_curve : at->second.at->fit;
      const auto member = std::find(larger.begin(), larger.end(), e) - larger.begin();
      for (std::size_t p = 0; p < effects[e].parameters.size(); ++p)
        if (const int i = fit.layout.find_shared(static_cast<std::size_t>(member), p); i >= 0)
          one.parameters.emplace_back(effects[e].parameters[p].name, fit.shared[i]);
      one.likelier = at->second.log_posterior() > from.log_posterior();
    } else if (const auto promised = search.promised().find(larger); promised != search.promised().end()) {
      const auto& predicted = promised->second;
      one.with_discrepancy = with_discrepancy && std::isfinite(predicted.log_bayes_factor_with_curve);
      const double factor = one.with_discrepancy ? predicted.log_bayes_factor_with_curve : predicted.log_bayes_factor;
      if (std::isfinite(factor)) one.log_bayes_factor = factor;
    } else {
      continue;
    }
    out.push_back(std::move(one));
  }
  // Those that are compared like the model that was chosen come first; null comes after all numbers.
  std::ranges::stable_sort(out, std::greater{}, [](const TriedEffect& one) {
    return std::pair(one.with_discrepancy, one.log_bayes_factor);
  });
  return out;
}

NeedleEstimate needle_estimate(const NeedleSystem& system, const Search& search, const ChosenModel& model) {
  NeedleEstimate out;
  out.value = system.needle(model.fit->shared);
  const MatrixXd covariance =
      shared_covariance(*model.fit, model.blocks, model.curve, nuisance_weights_of(search, *model.fit));
  const Eigen::RowVector2d by(1, out.value.lambda2 / std::numbers::pi);  // lambda1 by (u, lambda2)
  out.curvature_sd_per_mm = std::sqrt(covariance(kCurvature, kCurvature));
  out.slip_determined = system.determines_slip();
  if (!out.slip_determined) {
    out.lambda1_sd_per_rad = std::hypot(kUWidth_per_rad, by[1] * kLambda2Width);
    out.lambda2_sd = kLambda2Width;
    return out;
  }
  out.lambda1_sd_per_rad = std::sqrt((by * covariance.block<2, 2>(kU, kU) * by.transpose()).value());
  out.lambda2_sd = std::sqrt(covariance(kLambda2, kLambda2));
  return out;
}

std::vector<VariationEstimate> variation_of(const Search& search, const inference::Unknowns& unknowns) {
  std::vector<VariationEstimate> out;
  const auto& groups = search.system().nuisance_groups();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const VectorXd share = unknowns.of_group(g);
    VariationEstimate one{.name = groups[g].name, .unit = groups[g].unit};
    double below = 0;
    for (Index i = 0; i < share.size(); ++i) {
      const double value = groups[g].standard_deviations[static_cast<std::size_t>(i)];
      one.sd += share[i] * value;
      if (value == 0) one.none += share[i];
      if (below < 0.025) one.low = value;
      if (below < 0.975) one.high = value;
      below += share[i];
    }
    one.at_end = one.high >= groups[g].standard_deviations.back();
    out.push_back(std::move(one));
  }
  return out;
}

std::vector<InsertionValues> insertions_of(const NeedleSystem& system, const Search& search, const ChosenModel& model) {
  std::vector<InsertionValues> out;
  const Fit& fit = *model.fit;
  const auto posterior = nuisance_posterior(fit, model.blocks, model.curve, nuisance_weights_of(search, fit));
  for (std::size_t r = 0; r < posterior.size(); ++r) {
    InsertionValues one{.log = system.recorded().recordings[r].name, .values = {}};
    for (std::size_t i = 0; i < posterior[r].size(); ++i) {
      const inference::Nuisance& nuisance = system.nuisances()[i];
      const inference::Mixture& value = posterior[r][i];
      if (value.parts.empty()) continue;
      one.values.push_back({.name = nuisance.name,
                            .group = system.nuisance_groups()[nuisance.group].name,
                            .value = value.mean(),
                            .std_error = value.sd(),
                            .ci95 = {value.quantile(0.025), value.quantile(0.975)}});
    }
    out.push_back(std::move(one));
  }
  return out;
}

std::vector<Discrepancy> discrepancies_of(const NeedleSystem& system, const Search& search, const ChosenModel& model) {
  const Fit& fit = *model.fit;
  std::vector<Discrepancy> out;
  const auto& curves = fit.scales.curves;
  if (curves.empty()) return out;
  const MatrixXd covariance = solve_about(fit, model.blocks, model.curve).covariance;
  const auto at = search.discrepancy().places(curves);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    std::vector<double> std_errors;
    for (Index k = fit.shared.size() + at[i]; k < fit.shared.size() + at[i + 1]; ++k)
      std_errors.push_back(std::sqrt(std::max(0.0, covariance(k, k))));
    const auto& [curve, values] = model.discrepancy[i];
    auto others = model.discrepancy;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    out.push_back(
        {.curve = system.model_curve(curve, {values.begin(), values.end()}, std::move(std_errors)),
         .log_bayes_factor = search.visited().at(fit.layout.set()).at->log_factors[i],
         .visible_size = search.discrepancy().visible_size(curve, values),
         .moved_at_depth_mm = apart_at_depth_mm(system, tip_of(model, model.discrepancy), tip_of(model, others))});
  }
  return out;
}

}  // namespace bevel::diagnosis
