#pragma once
// The effects of a decision with their sizes and rivals, and the ranking of all that were tried.
#include "diagnosis/mismatch/decision.hpp"

namespace bevel::diagnosis {

// Effects of the model that was chosen.
std::vector<FoundEffect> found_effects(const NeedleSystem& system, const inference::Search& search,
                                       const inference::Posterior& posterior, const inference::Unknowns& unknowns,
                                       const ChosenModel& model);
// Every effect of the library, added to a set that was visited.
std::vector<TriedEffect> tried_beside(const inference::Search& search, const inference::ModelSet& set);
NeedleEstimate needle_estimate(const NeedleSystem& system, const inference::Search& search, const ChosenModel& model);
std::vector<VariationEstimate> variation_of(const inference::Search& search, const inference::Unknowns& unknowns);
// What each insertion has of its own, beside the model that was chosen.
std::vector<InsertionValues> insertions_of(const NeedleSystem& system, const inference::Search& search,
                                           const ChosenModel& model);
std::vector<Discrepancy> discrepancies_of(const NeedleSystem& system, const inference::Search& search,
                                          const ChosenModel& model);

// Equations for the discrepancy of the model that was chosen, about the mode beside it. Empty where it has none.
std::vector<ProposedForm> propose_forms(const NeedleSystem& system, const inference::Search& search,
                                        const ChosenModel& model);

}  // namespace bevel::diagnosis
