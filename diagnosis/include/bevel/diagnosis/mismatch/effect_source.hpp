// SPDX-License-Identifier: MIT
#pragma once
// The equation proposed for a discrepancy as the source of an effect: put into model/src/effects/, with a line in the
// registry, it is one like all others (docs/adding-an-effect.md).
#include <optional>
#include <string>

#include <bevel/diagnosis/mismatch/findings.hpp>

namespace bevel::diagnosis {

struct EffectSource {
  std::string name;  // of the effect and of its function: "advance_saturation_by_depth"
  std::string text;  // C++
};

EffectSource effect_source(const ProposedForm& proposal);

// The likeliest proposal for the discrepancy that shows most, where the verdict is unknown-effect; null otherwise. And
// its source.
const ProposedForm* proposed_form(const Findings& findings);
std::optional<EffectSource> proposed_effect(const Findings& findings);

}  // namespace bevel::diagnosis
