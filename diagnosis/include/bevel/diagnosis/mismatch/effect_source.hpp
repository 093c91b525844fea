// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Generates the C++ source of an effect from the equation proposed for a discrepancy. To add the effect to the
/// library, save the source in model/src/effects/ and add a line to the registry (docs/adding-an-effect.md).
#include <optional>
#include <string>

#include <bevel/diagnosis/mismatch/findings.hpp>

namespace bevel::diagnosis {

/// Generated source of an effect.
struct EffectSource {
  std::string name;  ///< name of the effect and of its function: "advance_saturation_by_depth"
  std::string text;  ///< C++ source
};

/// Generates the source of an effect.
/// @param proposal the equation with its estimates
/// @return name and source
EffectSource effect_source(const ProposedForm& proposal);

/// Selects the likeliest proposal for the discrepancy term with the largest visible size.
/// @param findings result of a diagnosis
/// @return pointer into findings; null if the verdict is not unknown-effect or there is no proposal
const ProposedForm* proposed_form(const Findings& findings);
/// Generates the source of the effect that proposed_form() selects.
/// @param findings result of a diagnosis
/// @return name and source; null if proposed_form() returns null
std::optional<EffectSource> proposed_effect(const Findings& findings);

}  // namespace bevel::diagnosis
