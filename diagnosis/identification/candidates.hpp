#pragma once
// The kinematic models side by side on the same insertions: the bicycle, and the extended one with either slip and
// either front wheel.
#include <string>
#include <vector>

#include "diagnosis/identification/figures.hpp"
#include "diagnosis/identification/trajectory_fit.hpp"

namespace bevel::diagnosis {

struct Candidate {
  std::string model;  // "bicycle", "extended, isotropic, published", ...
  bool extended = false;
  FitResult fit;
  ErrorFigures at_insertion;
  ErrorFigures at_depth;
  double bic = 0;        // n log(mean square) + p log(n), n the independent residuals; only differences count
  bool possible = true;  // false: the model cannot follow the insertions from any start; `why` says so
  std::string why;
};

// Fits all five, the bicycle first; `options` says what else is free, priors, loss. Without rotation the two slips are
// the same model and give the same row.
std::vector<Candidate> fit_candidates(const std::vector<Insertion>& insertions, const FitOptions& options);

// The bicycle's options out of the extended model's: both lambdas 0 and not fitted.
FitOptions bicycle_options(FitOptions options);

}  // namespace bevel::diagnosis
