// SPDX-License-Identifier: MIT
#pragma once
// Comparison of the kinematic models on the same insertions, and the selection of one of them: the bicycle, the
// extended model with either slip and either front wheel, and the best of these with entries that are tilted.
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/figures.hpp>
#include <bevel/diagnosis/identification/trajectory_fit.hpp>

namespace bevel::diagnosis {

struct Candidate {
  std::string model;  ///< "bicycle", "extended, isotropic, published", "bicycle, tilted entries", ...
  bool extended = false;
  FitResult fit;
  ErrorFigures at_insertion;
  ErrorFigures at_depth;
  /// Twice Huber's deviance with n independent residuals, plus p log n; p counts the needle's parameters and the tilts.
  /// Only differences between candidates have a meaning.
  double bic = 0;
  bool possible = true;  ///< false: the model cannot follow the insertions from any start; `why` has the reason
  std::string why;
};

/// Entry tilt of real rigs, rad (standard deviation), for the candidate with tilted entries.
inline constexpr double kTiltOfRealRigs_rad = 0.1;

/// Fits all candidates with fit_determined(): the bicycle, the four extended models (the one of options.start first;
/// without separate_slip() it alone), and, if \p options hold the entry's tilt at nominal, the bicycle and the best
/// extended model with insertion-specific tilts.
std::vector<Candidate> fit_candidates(const std::vector<Insertion>& insertions, const FitOptions& options);

/// Selects the candidate with the lowest BIC, the first of those that are equal within the fits' tolerance.
///
/// @return index into \p all
/// @throws ArgumentError with the reason of the first candidate, if none can follow the insertions
std::size_t preferred(const std::vector<Candidate>& all);

// The bicycle's options out of the extended model's: both lambdas 0 and not fitted.
FitOptions bicycle_options(FitOptions options);

}  // namespace bevel::diagnosis
