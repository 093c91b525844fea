#pragma once
// From a selected set to what is said of it: probabilities, rivals, intervals, detectable sizes, the next experiment,
// and the sentence.
#include "diagnosis/mismatch/findings.hpp"
#include "diagnosis/mismatch/selection.hpp"

namespace bevel::diagnosis {

// Fills all of `findings` that follows from the selection (not: held_out, where, noise, traces).
void conclude(Selection& selection, const Fit& base, const EffectSet& set, Findings& findings, int threads);

// A part of it, for tests.
double probability_of(const std::vector<std::pair<EffectSet, double>>& visited, const Member& member);

}  // namespace bevel::diagnosis
