#include "diagnosis/mismatch/decision.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "diagnosis/inference/curved_fit.hpp"
#include "diagnosis/inference/own_volume.hpp"

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

Decision decide(const Search& search, const Posterior& posterior) {
  const double something = 1 - posterior.nothing;
  std::set<std::string> names;
  if (something > 0.5)
    for (const auto& [name, probability] : posterior.inclusion)
      if (probability > 0.5 * something) names.insert(name);
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
      const auto held = static_cast<std::size_t>(
          std::count_if(names.begin(), names.end(), [&](const auto& name) { return own.contains(name); }));
      all.push_back(
          {&one, held, own.size() > held, with_discrepancy ? share.unknown : share.probability - share.unknown});
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
  bool unknown = something > 0.5 && posterior.discrepancy > 0.5 * something;
  const inference::Visited* best = something > 0.5 ? likeliest(unknown) : nullptr;
  if (!best && something > 0.5 && posterior.discrepancy > 0) unknown = true, best = likeliest(true);
  if (!best) unknown = false, best = &search.visited().at({});  // a discrepancy that no mode shows
  Decision out;
  out.verdict = unknown             ? Verdict::unknown_effect
                : best->set.empty() ? Verdict::nothing_missing
                                    : Verdict::effects_found;
  out.model = model_of(search, unknown ? *best->at->fit_with_curve : best->at->fit);
  return out;
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
