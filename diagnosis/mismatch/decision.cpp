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
  Decision out;
  const double something = 1 - posterior.nothing;
  std::set<std::string> names;
  bool unknown = false;
  if (something > 0.5) {
    for (const auto& [name, probability] : posterior.inclusion)
      if (probability > 0.5 * something) names.insert(name);
    unknown = posterior.discrepancy > 0.5 * something;
    if (names.empty() && !unknown) {
      // No name and no discrepancy by itself: the likeliest set, by its share without one.
      double most = 0;
      for (const auto& share : posterior.sets)
        if (const double plain = share.probability - share.with_discrepancy; !share.set.empty() && plain > most)
          names = names_of(search, share.set), most = plain;
      unknown = names.empty() && posterior.discrepancy > 0;
    }
  }
  // The likeliest set of just these names; if none was visited, of those with as many of them as any.
  const inference::Visited* best = nullptr;
  std::size_t best_shared = 0;
  const auto log = [&](const inference::Visited& v) { return unknown ? v.log_with_curve : v.log_without_curve; };
  for (const auto& [set, one] : search.visited()) {
    if (unknown && !one.at->fit_with_curve) continue;
    const auto held = names_of(search, set);
    const auto shared = static_cast<std::size_t>(
        std::count_if(names.begin(), names.end(), [&](const auto& name) { return held.contains(name); }));
    const std::size_t score = 2 * shared + (held == names ? 1 : 0);
    if (!best || score > best_shared || (score == best_shared && log(one) > log(*best)))
      best = &one, best_shared = score;
  }
  if (!best) {  // a discrepancy that no mode shows
    unknown = false;
    best = &search.visited().at({});
  }
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
