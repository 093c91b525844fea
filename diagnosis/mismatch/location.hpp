#pragma once
// Where the model in use goes wrong: in which recordings, when, and over which range of the covariate that the effect
// acts on.
#include "diagnosis/mismatch/decision.hpp"

namespace bevel::diagnosis {

// The spans with most of the fall of chi2 from `before` to `after` (fits by one noise), at most one per recording,
// largest first. Effects with a depth or an instant of their own begin there; `covariate` names what the range is of.
std::vector<Location> locate(const NeedleSystem& system, const ChosenModel& before, const ChosenModel& after,
                             std::size_t at_most);

// One per recording, for pictures.
std::vector<Trace> make_traces(const NeedleSystem& system, const inference::Readings& outliers,
                               const ChosenModel& before, const ChosenModel& after,
                               const model::NeedleParameters& model_file);

}  // namespace bevel::diagnosis
