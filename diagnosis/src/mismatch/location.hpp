// SPDX-License-Identifier: MIT
#pragma once
// Locates the missing physics: in which recordings, from when on, and over which range of the covariate that the
// effect depends on.
#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

/// Locates the missing physics: for each recording, when it begins to act (onset.hpp), the channel in which it lowers
/// chi2 most, and the range of the covariate during the onset. An effect that has a depth or an event time
/// begins no earlier than there. Recordings in which the onset is not determined are left out.
/// @param before the nominal model, refitted with the noise of `after`
/// @param at_most number of recordings, those with the largest fall of chi2 first
std::vector<Location> locate(const NeedleSystem& system, const ChosenModel& before, const ChosenModel& after,
                             std::size_t at_most);

// One per recording, for pictures.
std::vector<Trace> make_traces(const NeedleSystem& system, const inference::Readings& outliers,
                               const ChosenModel& before, const ChosenModel& after,
                               const model::NeedleParameters& model_file);

}  // namespace bevel::diagnosis
