// SPDX-License-Identifier: MIT
#pragma once
// The effects of a decision with their sizes and rivals, and the ranking of all that were tried.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

// Effects of the model that was chosen.
std::vector<FoundEffect> found_effects(const NeedleSystem& system, const inference::Search& search,
                                       const inference::Posterior& posterior, const inference::Unknowns& unknowns,
                                       const ChosenModel& model);
/// Returns why a member of a model may not be named: none of its sizes has a 95 % interval that excludes "no effect",
/// or its log Bayes factor is not positive. Empty if it may.
std::string fault_of_name(const NeedleSystem& system, const inference::Search& search,
                          const inference::Unknowns& unknowns, const ChosenModel& model, std::size_t member);
/// Lists every effect of the library added to a fitted candidate model, the largest log Bayes factor first.
/// @param with_discrepancy compare both with a discrepancy, where that was computed for both
std::vector<TriedEffect> tried_beside(const inference::Search& search, const inference::ModelSet& set,
                                      bool with_discrepancy);
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
