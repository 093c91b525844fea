// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The part of a model file that is known before an insertion. Effects with insertion-specific parameters (an event
/// time, a phase) are left out, since the values for the next insertion are unknown.
#include <string>
#include <vector>

#include <bevel/io/model_file.hpp>

namespace bevel::io {

/// Lists the parameters of an effect that differ between recordings.
/// @param effect  entry of a model file
/// @return names separated by commas; "" if there are none, or if the effect does not exist
std::string unknown_beforehand(const EffectEntry& effect);

/// Effects for an insertion that has not taken place yet.
struct LiveEffects {
  std::vector<model::ActiveEffect> active;  ///< effects and discrepancy terms that are known
  std::vector<std::string> left_out;        ///< for each other effect a sentence with its name and what is unknown
};
/// Selects the effects for programs that use a model while the needle moves, so that the estimator and the controller
/// have the same effects.
/// @param effects  effects of a model file
/// @param discrepancies  discrepancy terms of a model file; all of them are known
/// @return the effects, followed by the discrepancy terms
/// @throws ArgumentError as active_effects()
LiveEffects live_effects(const std::vector<EffectEntry>& effects,
                         const std::vector<model::DiscrepancyCurve>& discrepancies = {});

}  // namespace bevel::io
