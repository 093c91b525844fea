// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Describes the adopted model: effects with their sizes and confounders, the ranking of all effects, and the estimates
/// of the needle and of the between-insertion standard deviations.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

/// Describes the effects of the adopted model.
/// @param system recordings
/// @param search completed search
/// @param posterior posterior over its candidate models
/// @param unknowns posterior densities of the parameters
/// @param model the adopted model
/// @return one entry per effect
std::vector<FoundEffect> found_effects(const NeedleSystem& system, const inference::Search& search,
                                       const inference::Posterior& posterior, const inference::Unknowns& unknowns,
                                       const ChosenModel& model);
/// Returns why a member of a model may not be named: none of its sizes has a 95 % interval that excludes "no effect",
/// or its log Bayes factor is not positive.
/// @param system recordings
/// @param search completed search
/// @param unknowns posterior densities of the parameters
/// @param model the model
/// @param member position of the effect in the model's set
/// @return clause with the reason; empty if the member may be named
std::string fault_of_name(const NeedleSystem& system, const inference::Search& search,
                          const inference::Unknowns& unknowns, const ChosenModel& model, std::size_t member);
/// Lists every effect of the library added to a fitted candidate model, the largest log Bayes factor first.
/// @param search completed search
/// @param set the candidate model
/// @param with_discrepancy compare both with a discrepancy, where that was computed for both
/// @return one entry per effect
std::vector<TriedEffect> tried_beside(const inference::Search& search, const inference::ModelSet& set,
                                      bool with_discrepancy);
/// Estimates the needle's parameters in a model.
/// @param system recordings
/// @param search completed search
/// @param model the model
/// @return estimates and standard deviations
NeedleEstimate needle_estimate(const NeedleSystem& system, const inference::Search& search, const ChosenModel& model);
/// Estimates the between-insertion standard deviations.
/// @param search completed search
/// @param unknowns posterior densities of the parameters
/// @return one entry per group of insertion-specific parameters
std::vector<VariationEstimate> variation_of(const inference::Search& search, const inference::Unknowns& unknowns);
/// Estimates the insertion-specific parameters jointly with the adopted model.
/// @param system recordings
/// @param search completed search
/// @param model the adopted model
/// @return one entry per recording, in their order
std::vector<InsertionValues> insertions_of(const NeedleSystem& system, const inference::Search& search,
                                           const ChosenModel& model);
/// Describes the discrepancy terms of the adopted model.
/// @param system recordings
/// @param search completed search
/// @param model the adopted model
/// @return one entry per term; empty if it has none
std::vector<Discrepancy> discrepancies_of(const NeedleSystem& system, const inference::Search& search,
                                          const ChosenModel& model);

/// Fits closed forms to each discrepancy term of the adopted model, linearised about the mode without that term.
/// @param system recordings
/// @param search completed search
/// @param model the adopted model
/// @return the forms of each term in turn, the likeliest first, no more than four per term; empty if there is no term
std::vector<ProposedForm> propose_forms(const NeedleSystem& system, const inference::Search& search,
                                        const ChosenModel& model);

}  // namespace bevel::diagnosis
