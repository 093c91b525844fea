// SPDX-License-Identifier: MIT
#pragma once
// What a model file knows before an insertion. Effects with an unknown of the single recording (an instant, a phase)
// are left out: the next one's is not known, and a guess would be taken for a measurement.
#include <string>
#include <vector>

#include <bevel/io/model_file.hpp>

namespace bevel::io {

// Names of the effect's parameters that differ from recording to recording, with commas in between; empty if the
// effect is known beforehand, or if there is no such effect.
std::string unknown_beforehand(const EffectEntry& effect);

struct LiveEffects {
  std::vector<model::ActiveEffect> active;
  std::vector<std::string> left_out;  // for each of the others a sentence with its name and what is not known
};
// For whoever acts on a model while the needle moves: the estimator and the controller have the same effects. Throws
// ArgumentError as active_effects() does.
// The discrepancies, which are all known beforehand, come behind the effects.
LiveEffects live_effects(const std::vector<EffectEntry>& effects,
                         const std::vector<model::DiscrepancyCurve>& discrepancies = {});

}  // namespace bevel::io
