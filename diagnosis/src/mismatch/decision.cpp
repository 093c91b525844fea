// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/decision.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include <bevel/diagnosis/inference/curved_fit.hpp>
#include <bevel/diagnosis/inference/own_volume.hpp>

namespace bevel::diagnosis {

using inference::Fit;
using inference::ModelSet;
using inference::Posterior;
using inference::Search;

namespace {

std::set<std::string> names_of(const Search& search, const ModelSet& set) {
  std::set<std::string> out;
  for (const std::size_t e : set) out.insert(search.system().effects()[e].name);
  return out;
}

}  // namespace

ChosenModel model_of(const Search& search, const Fit& fit) {
  ChosenModel out{.fit = &fit, .curve = curve_of(search, fit), .blocks = {}};
  out.blocks = linearise(*fit.likelihood, fit, out.curve);
  out.discrepancy = values_by_curve(search.discrepancy(), fit.scales.curves, fit.curve_values);
  return out;
}

double consequence_sigmas(const inference::SearchRules& rules) { return std::sqrt(-2 * rules.log_prior_odds_effect); }

std::vector<std::string> confounders_of(const Search& search, const Posterior& posterior, const ModelSet& set,
                                        std::size_t effect) {
  const auto& effects = search.system().effects();
  const ModelSet rest = inference::without(set, effect);
  const auto here = std::ranges::find(posterior.sets, set, &inference::SetShare::set);
  const double least = here == posterior.sets.end() ? 0 : here->probability / kConfounderOdds;
  std::set<std::string> names;
  for (const auto& share : posterior.sets) {
    if (share.set.size() != set.size() || share.probability < least) continue;
    std::vector<std::size_t> added;
    std::ranges::set_difference(share.set, rest, std::back_inserter(added));
    if (added.size() == 1 && effects[added[0]].name != effects[effect].name) names.insert(effects[added[0]].name);
  }
  return {names.begin(), names.end()};
}

double joint_probability(const Search& search, const Posterior& posterior, const ModelSet& set, std::size_t effect) {
  std::set<std::string> any{search.system().effects()[effect].name};
  for (auto& name : confounders_of(search, posterior, set, effect)) any.insert(std::move(name));
  double sum = 0;
  for (const auto& share : posterior.sets) {
    const auto own = names_of(search, share.set);
    if (std::ranges::any_of(own, [&](const auto& name) { return any.contains(name); })) sum += share.probability;
  }
  return std::min(sum, 1.0);
}

namespace {

// Part of a candidate model's probability, with an unmodelled discrepancy that counts or without one.
double part_of(const inference::SetShare& share, bool unknown) {
  return unknown ? share.unknown : share.probability - share.unknown;
}

struct Choice {
  const inference::Visited* at;
  bool unknown;
};

// Chooses the likeliest model with the named effects, among those without a refused effect.
Choice choose(const Search& search, const Posterior& posterior, const std::set<std::string>& refused) {
  const double something = 1 - posterior.nothing;
  const Choice nothing{&search.visited().at({}), false};
  if (!(something > 0.5)) return nothing;
  std::set<std::string> names;
  for (const auto& [name, probability] : posterior.inclusion)
    if (probability > 0.5 * something && !refused.contains(name)) names.insert(name);
  // A model that is far less likely than another one is not reported.
  double likeliest_part = 0;
  for (const auto& share : posterior.sets)
    likeliest_part = std::max({likeliest_part, part_of(share, false), part_of(share, true)});
  // Of the sets that hold these names, or as many of them as any: those with another effect if that there is one is
  // likelier than not, else that without, and of these the likeliest. With a discrepancy that counts, or without one.
  const auto likeliest = [&](bool with_discrepancy) {
    struct Candidate {
      const inference::Visited* one;
      std::size_t held;
      bool more;
      double probability;
    };
    std::vector<Candidate> all;
    for (const auto& share : posterior.sets) {
      const auto& one = search.visited().at(share.set);
      if (with_discrepancy ? !one.at->fit_with_curve : share.set.empty()) continue;
      const auto own = names_of(search, share.set);
      if (std::ranges::any_of(own, [&](const auto& name) { return refused.contains(name); })) continue;
      const auto held = static_cast<std::size_t>(
          std::count_if(names.begin(), names.end(), [&](const auto& name) { return own.contains(name); }));
      const double part = part_of(share, with_discrepancy);
      if (part * kConfounderOdds >= likeliest_part) all.push_back({&one, held, own.size() > held, part});
    }
    std::size_t most = 0;
    for (const Candidate& one : all) most = std::max(most, one.held);
    std::erase_if(all, [&](const Candidate& one) { return one.held < most; });
    double more = 0;
    for (const Candidate& one : all)
      if (one.more) more += one.probability;
    const bool another = more > 0.5 * something || std::ranges::all_of(all, &Candidate::more);
    const Candidate* best = nullptr;
    for (const Candidate& one : all)
      if (one.more == another && (!best || one.probability > best->probability)) best = &one;
    return best ? best->one : nullptr;
  };
  const bool unknown = posterior.discrepancy > 0.5 * something;
  if (const auto* best = likeliest(unknown)) return {best, unknown};
  if (!unknown && refused.empty() && posterior.discrepancy > 0)
    if (const auto* best = likeliest(true)) return {best, true};
  return nothing;  // or a discrepancy that no mode shows
}

double probability_of(const Search& search, const Posterior& posterior, const Decision& decision) {
  if (decision.verdict == Verdict::nothing_missing) return posterior.nothing;
  const auto named = names_of(search, decision.model.fit->layout.set());
  double sum = 0;
  for (const auto& share : posterior.sets)
    if (names_of(search, share.set) == named) sum += part_of(share, decision.verdict == Verdict::unknown_effect);
  return sum;
}

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

}  // namespace

Decision inconclusive(const Search& search, std::vector<std::string> reasons) {
  return {.verdict = Verdict::inconclusive,
          .model = model_of(search, search.visited().at({}).at->fit),
          .probability = 0,
          .reasons = std::move(reasons)};
}

Decision decide(const Search& search, const Posterior& posterior, const FaultOfName& fault_of) {
  if (posterior.not_visited > inference::kMostNotFitted)
    return inconclusive(search, {percent(posterior.not_visited) +
                                 " of the probability is in candidate models that were not fitted; at most " +
                                 percent(inference::kMostNotFitted) + " may be"});
  std::vector<std::string> reasons;
  std::set<std::string> refused;
  for (;;) {
    const auto [at, unknown] = choose(search, posterior, refused);
    if (at->set.empty() && !unknown && !refused.empty()) return inconclusive(search, std::move(reasons));
    Decision out;
    out.verdict = unknown           ? Verdict::unknown_effect
                  : at->set.empty() ? Verdict::nothing_missing
                                    : Verdict::effects_found;
    out.model = model_of(search, unknown ? *at->at->fit_with_curve : at->at->fit);
    out.reasons = reasons;
    std::string name;
    for (std::size_t m = 0; m < at->set.size() && name.empty(); ++m) {
      const double joint = joint_probability(search, posterior, at->set, at->set[m]);
      const std::string fault = joint < kLeastProbability
                                    ? "its probability, with that of its confounders, is " + percent(joint)
                                    : fault_of(out.model, m);
      if (fault.empty()) continue;
      name = search.system().effects()[at->set[m]].name;
      reasons.push_back(name + " is not named: " + fault);
    }
    if (name.empty()) {
      out.probability = probability_of(search, posterior, out);
      return out;
    }
    refused.insert(name);
  }
}

Fit refitted_base(const Search& search, const Fit& like) {
  const inference::Layout nothing(search.system(), {});
  const Fit& base = search.visited().at({}).at->fit;
  Fit out =
      fit(*like.likelihood, nothing, base.shared, base.local, {.nuisance_sd = like.scales.nuisance_sd, .curves = {}});
  out.likelihood = like.likelihood;
  return with_own_integrated(std::move(out), inference::everywhere({}));
}

}  // namespace bevel::diagnosis
