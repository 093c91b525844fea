// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Computes the error of a model's path in the two ways that are in use in the literature.
#include <vector>

#include <bevel/diagnosis/identification/path.hpp>

namespace bevel::diagnosis {

/// Which points of the measured and the predicted path are compared.
enum class Compare {
  /// Points of equal inserted length. It is the error that affects a controller or a filter. Only the axes that the
  /// camera sees count.
  same_insertion,
  /// Points of equal depth z in {A}: lateral distance of the drawn paths. The bicycle column of Table I follows from
  /// its
  /// own lambdas by this definition only (3.64 mm for agar against 2.3 mm at equal length).
  same_depth
};

/// Summary of path errors.
struct ErrorFigures {
  double rms_mm = 0;         ///< root mean square error, mm
  double largest_mm = 0;     ///< largest absolute error, mm
  double largest_at_mm = 0;  ///< insertion at which the largest error occurs, mm
  std::size_t count = 0;     ///< number of errors
};

/// Computes the error of each observation.
/// @param insertion the insertion
/// @param needle parameters of the model
/// @param compare which points are compared
/// @param entry entry of the needle
/// @return errors, mm: the distance for same_insertion, the signed lateral error along y (model minus measured) for
///   same_depth. The first crossing of a depth counts; NaN if the model does not reach the depth
/// @throws bevel::DomainError if the model leaves its domain
std::vector<double> path_errors_mm(const Insertion& insertion, const model::NeedleParameters& needle, Compare compare,
                                   const Entry& entry = Entry::Zero());

/// Computes the summary of the errors of one insertion.
/// @param insertion the insertion
/// @param errors_mm one error per observation, mm; NaN is ignored
/// @return the summary
ErrorFigures summarise(const Insertion& insertion, const std::vector<double>& errors_mm);
/// Computes the summary of the errors of all insertions.
/// @param insertions any number of insertions
/// @param needle parameters of the model
/// @param compare which points are compared
/// @param entries entry of each insertion; nominal for insertions without one
/// @return the summary over all observations
/// @throws bevel::DomainError as path_errors_mm()
ErrorFigures error_figures(const std::vector<Insertion>& insertions, const model::NeedleParameters& needle,
                           Compare compare, const std::vector<Entry>& entries = {});

/// Averages trials with identical commands, measurement by measurement. Section IV of the paper compares with the mean
/// of three trials.
/// @param trials at least one trial
/// @return the first trial with mean positions; its whitening is that of the mean
/// @throws bevel::ArgumentError if there is no trial, or their numbers of measurements differ
Insertion mean_of_trials(const std::vector<Insertion>& trials);

}  // namespace bevel::diagnosis
