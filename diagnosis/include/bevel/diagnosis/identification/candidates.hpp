// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Compares kinematic models on identical insertions and selects one: the bicycle model, the extended model with each
/// slip direction and each front wheel, and the best of these with tilted entries.
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/figures.hpp>
#include <bevel/diagnosis/identification/trajectory_fit.hpp>

namespace bevel::diagnosis {

/// One fitted model.
struct Candidate {
  std::string model;          ///< "bicycle", "extended, isotropic, published", "bicycle, tilted entries", ...
  bool extended = false;      ///< whether it is the extended model; false: the bicycle model
  FitResult fit;              ///< fit by fit_determined()
  ErrorFigures at_insertion;  ///< errors at equal inserted length
  ErrorFigures at_depth;      ///< errors at equal depth
  /// Twice Huber's deviance with n independent residuals, plus p log n; p counts the needle's parameters and the tilts.
  /// Only differences between candidates have a meaning.
  double bic = 0;
  bool possible = true;  ///< false: the model cannot follow the insertions from any start; `why` has the reason
  std::string why;       ///< reason if possible is false
};

/// Entry tilt of real rigs, rad (standard deviation), for the candidate with tilted entries.
inline constexpr double kTiltOfRealRigs_rad = 0.1;

/// Fits all candidates with fit_determined(): the bicycle, the four extended models (the one of options.start first;
/// without separate_slip() it alone), and, if \p options hold the entry's tilt at nominal, the bicycle and the best
/// extended model with insertion-specific tilts.
/// @param insertions at least one insertion
/// @param options as for fit_trajectory()
/// @return all candidates; Candidate::possible is false for those that failed
std::vector<Candidate> fit_candidates(const std::vector<Insertion>& insertions, const FitOptions& options);

/// Selects the candidate with the lowest BIC, the first of those that are equal within the fits' tolerance.
/// @param all candidates of one call of fit_candidates()
/// @return index into \p all
/// @throws bevel::ArgumentError with the reason of the first candidate, if none can follow the insertions
std::size_t preferred(const std::vector<Candidate>& all);

/// Derives the options of the bicycle model: both lambda are 0, and neither they nor ell are fitted.
/// @param options options of the extended model
/// @return options of the bicycle model
FitOptions bicycle_options(FitOptions options);

}  // namespace bevel::diagnosis
