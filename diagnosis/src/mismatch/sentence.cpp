// SPDX-License-Identifier: MIT
#include "mismatch/sentence.hpp"

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

// What is on no list, and what was named beside it.
std::string off_with(const Findings& findings) {
  std::string text;
  for (const Discrepancy& one : findings.discrepancies)
    text += (text.empty() ? "the " : ", and the ") + std::string(info_of(one.curve.component).meaning) +
            " is off with " + std::string(model::name_of(one.curve.covariate));
  return text + (findings.effects.empty() ? "." : ", beside " + listed(findings.effects) + ".");
}

// The reasons and the motion that would decide.
std::string inconclusive_because(const Findings& findings) {
  std::string text = "The recordings do not decide";
  for (const std::string& reason : findings.reasons)
    text += (&reason == findings.reasons.data() ? ": " : "; ") + reason;
  const auto& next = findings.next_experiment;
  return text +
         (next ? ". The next experiment would decide between " + next->separates[0] + " and " + next->separates[1] + "."
               : ". More recordings, with turns and at two speeds, would decide.");
}

std::string sentence_on_change(const Findings& findings) {
  switch (findings.verdict) {
    case Verdict::nothing_missing:
      return "Nothing changed between the two groups that these recordings could show.";
    case Verdict::effects_found:
      return "What changed: " + listed(findings.effects) + ".";
    case Verdict::inconclusive:
      return inconclusive_because(findings);
    case Verdict::unknown_effect:
      break;
  }
  return "Something changed that no effect of the library explains: in the second group " + off_with(findings);
}

}  // namespace

std::string sentence_of(const Findings& findings) {
  if (findings.two_groups) return sentence_on_change(findings);
  switch (findings.verdict) {
    case Verdict::nothing_missing:
      return "Nothing is missing from the model that these recordings could show.";
    case Verdict::effects_found:
      return "The model leaves out " + listed(findings.effects) + ".";
    case Verdict::inconclusive:
      return inconclusive_because(findings);
    case Verdict::unknown_effect:
      break;
  }
  return "Something is missing that no effect of the library explains: " + off_with(findings);
}

}  // namespace bevel::diagnosis
