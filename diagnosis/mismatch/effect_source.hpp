#pragma once
// The equation proposed for a discrepancy as the source of an effect: put into model/effects/, with a line in the
// registry, it is one like all others (docs/adding-an-effect.md).
#include <optional>
#include <string>

#include "diagnosis/mismatch/findings.hpp"

namespace bevel::diagnosis {

struct EffectSource {
  std::string name;  // of the effect and of its function: "advance_saturation_by_depth"
  std::string text;  // C++
};

EffectSource effect_source(const ProposedForm& proposal);

// Of the likeliest proposal, where the verdict is unknown-effect. Nothing otherwise.
std::optional<EffectSource> proposed_effect(const Findings& findings);

}  // namespace bevel::diagnosis
