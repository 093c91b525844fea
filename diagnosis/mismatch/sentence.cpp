#include "diagnosis/mismatch/sentence.hpp"

namespace bevel::diagnosis {
namespace {

std::string listed(const std::vector<FoundEffect>& effects) {
  std::string text;
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (i > 0) text += i + 1 == effects.size() ? " and " : ", ";
    text += effects[i].name + " (" + effects[i].meaning + ")";
  }
  return text;
}

}  // namespace

std::string sentence_of(const Findings& findings) {
  switch (findings.verdict) {
    case Verdict::nothing_missing:
      return "Nothing is missing from the model that these recordings could show.";
    case Verdict::effects_found:
      return "The model leaves out " + listed(findings.effects) + ".";
    case Verdict::unknown_effect:
      break;
  }
  const model::DiscrepancyCurve& curve = findings.discrepancies.front().curve;
  return "Something is missing that no effect of the library explains: the " +
         std::string(info_of(curve.component).meaning) + " is off with " +
         std::string(model::name_of(curve.covariate)) +
         (findings.effects.empty() ? "." : ", beside " + listed(findings.effects) + ".");
}

}  // namespace bevel::diagnosis
