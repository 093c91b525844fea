// SPDX-License-Identifier: MIT
#include "mismatch/reach.hpp"

#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/parallel.hpp>

namespace bevel::diagnosis {

using inference::Layout;

namespace {

// The base with one effect in the middle of its starts, where it happens at an instant, 2 s after the beginning.
Imagined with_effect(const NeedleSystem& system, const Imagined& base, std::size_t effect) {
  constexpr double kSoon_s = 2.0;
  const Layout layout(system, {effect}), nothing(system, {});
  Imagined out = base;
  out.set = {effect};
  out.shared = layout.shared_from(nothing, base.shared);
  out.local = layout.local_from(nothing, base.local);
  const auto& parameters = system.effects()[effect].parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    if (const int i = layout.find_shared(0, p); i >= 0)
      out.shared[i] = parameters[p].starts[parameters[p].starts.size() / 2];
    if (const int i = layout.find_local(0, p); i >= 0 && parameters[p].scope == inference::Scope::instant)
      out.local[i] = kSoon_s;
  }
  return out;
}

}  // namespace

void find_reach(const NeedleSystem& system, const inference::Search& search, const ChosenModel& base,
                const Experiments& experiments, Findings& findings) {
  const inference::Reach reach = search.proposals().reach(search.base_marginal());
  for (const auto& size : reach.sizes) {
    const auto& effect = system.effects()[size.effect];
    findings.detectable.push_back({.effect = effect.name,
                                   .parameter = effect.parameters[size.parameter].name,
                                   .size = kVisibleSigmas * size.one_deviation,
                                   .typical = size.typical,
                                   .absorbed = size.absorbed,
                                   .experiment = ""});
  }
  for (const std::size_t e : reach.effects) findings.confusion_names.push_back(system.effects()[e].label);
  findings.confusion = reach.cosine;
  const Imagined nothing = imagined(*base.fit, base);
  parallel_for(findings.detectable.size(), [&](std::size_t i) {
    DetectableSize& one = findings.detectable[i];
    if (one.size < one.typical) return;
    one.experiment = experiments.best(with_effect(system, nothing, reach.sizes[i].effect), nothing).script;
  });
}

}  // namespace bevel::diagnosis
