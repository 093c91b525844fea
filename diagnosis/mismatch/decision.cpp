#include "diagnosis/mismatch/decision.hpp"

#include <algorithm>
#include <set>

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

ChosenModel model_of(const Search& search, const Fit& fit, double log_posterior) {
  ChosenModel out{.fit = &fit, .curve = curve_of(search, fit), .blocks = {}, .log_posterior = log_posterior};
  out.blocks = linearise(*fit.likelihood, fit, out.curve);
  const auto& curves = fit.scales.curves;
  const auto at = search.discrepancy().places(curves);
  for (std::size_t i = 0; i < curves.size(); ++i)
    out.discrepancy.push_back({curves[i].curve, fit.curve_values.segment(at[i], at[i + 1] - at[i])});
  return out;
}

Decision decide(const Search& search, const Posterior& posterior) {
  const double something = 1 - posterior.nothing;
  std::set<std::string> names;
  if (something > 0.5)
    for (const auto& [name, probability] : posterior.inclusion)
      if (probability > 0.5 * something) names.insert(name);
  // The likeliest of the sets that hold these names, or as many of them as any: it has another effect where that there
  // is one is likelier than not, and rivals share it. By their shares with a discrepancy, or by those without.
  const auto likeliest = [&](bool with_discrepancy) {
    const inference::Visited* best = nullptr;
    std::ptrdiff_t most = 0;
    double highest = 0;
    for (const auto& share : posterior.sets) {
      const auto& one = search.visited().at(share.set);
      if (with_discrepancy ? !one.at->fit_with_curve : share.set.empty()) continue;
      const auto held = names_of(search, share.set);
      const auto count =
          std::count_if(names.begin(), names.end(), [&](const auto& name) { return held.contains(name); });
      const double probability = with_discrepancy ? share.with_discrepancy : share.probability - share.with_discrepancy;
      if (!best || count > most || (count == most && probability > highest))
        best = &one, most = count, highest = probability;
    }
    return best;
  };
  bool unknown = something > 0.5 && posterior.discrepancy > 0.5 * something;
  const inference::Visited* best = something > 0.5 ? likeliest(unknown) : nullptr;
  if (!best && something > 0.5 && posterior.discrepancy > 0) unknown = true, best = likeliest(true);
  if (!best) unknown = false, best = &search.visited().at({});  // a discrepancy that no mode shows
  Decision out;
  out.verdict = unknown             ? Verdict::unknown_effect
                : best->set.empty() ? Verdict::nothing_missing
                                    : Verdict::effects_found;
  out.model = unknown ? model_of(search, *best->at->fit_with_curve, best->log_with_curve)
                      : model_of(search, best->at->fit, best->log_without_curve);
  return out;
}

Fit refitted_base(const Search& search, const Fit& like) {
  const inference::Layout nothing(search.system(), {});
  const Fit& base = search.visited().at({}).at->fit;
  Fit out =
      fit(*like.likelihood, nothing, base.shared, base.local, {.nuisance_sd = like.scales.nuisance_sd, .curves = {}});
  out.likelihood = like.likelihood;
  return out;
}

}  // namespace bevel::diagnosis
