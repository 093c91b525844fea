// SPDX-License-Identifier: MIT
#include <bevel/io/live_effects.hpp>

namespace bevel::io {

std::string unknown_beforehand(const EffectEntry& entry) {
  std::string names;
  if (const model::Effect* effect = model::find_effect(entry.name))
    for (const auto& parameter : effect->parameters())
      if (parameter.scope == model::Scope::recording)
        names += (names.empty() ? "" : ", ") + std::string(parameter.name);
  return names;
}

LiveEffects live_effects(const std::vector<EffectEntry>& effects,
                         const std::vector<model::DiscrepancyCurve>& discrepancies) {
  LiveEffects live;
  std::vector<EffectEntry> known;
  for (const auto& entry : effects) {
    if (const std::string unknown = unknown_beforehand(entry); unknown.empty())
      known.push_back(entry);
    else
      live.left_out.push_back("effect " + entry.name + " is left out: its " + unknown +
                              " differs from recording to recording and is not known before the next insertion");
  }
  live.active = active_effects(known, discrepancies, "");
  return live;
}

}  // namespace bevel::io
