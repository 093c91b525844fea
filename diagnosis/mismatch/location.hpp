#pragma once
// Where the model in use goes wrong: in which recordings, when, and over which range of the covariate that the effect
// acts on.
#include "diagnosis/mismatch/findings.hpp"
#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// The spans with most of the fall of chi2 from `before` to `after`, at most one per recording, largest first. Effects
// with a depth or an instant of their own begin there; `covariate` names what the range is of.
std::vector<Location> locate(const Evidence& evidence, const Fit& before, const Fit& after, std::size_t at_most);

// One per recording, for pictures.
std::vector<Trace> make_traces(const Evidence& evidence, const RecordedCase& with_outliers, const Fit& before,
                               const Fit& after, const model::NeedleParameters& model_file);

FitFigures figures_of(const Evidence& evidence, const Hypothesis& hypothesis, std::size_t recording,
                      const Eigen::VectorXd& values, FitFigures& sum, std::size_t& count);

}  // namespace bevel::diagnosis
