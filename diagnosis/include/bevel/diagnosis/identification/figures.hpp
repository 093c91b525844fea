// SPDX-License-Identifier: MIT
#pragma once
// How far a model's path is from what was seen, in the two ways that the literature mixes.
#include <vector>

#include <bevel/diagnosis/identification/path.hpp>

namespace bevel::diagnosis {

// Against the same inserted length: what a controller or a filter suffers. Only the axes that the camera sees count.
// Against the same depth (z_A): lateral distance of the paths as drawn. Table I's bicycle column follows from its own
// lambdas only by this one (3.64 mm for agar against 2.3 mm at the same length).
enum class Compare { same_insertion, same_depth };

struct ErrorFigures {
  double rms_mm = 0;
  double largest_mm = 0;
  double largest_at_mm = 0;  // insertion at which the largest occurs
  std::size_t count = 0;
};

// Error of each observation, mm: the distance for same_insertion, the signed lateral (y) error for same_depth. Depth
// has no answer where the needle turned back; the first crossing counts, NaN if the model never gets there. Throws
// DomainError where the model leaves its domain.
std::vector<double> path_errors_mm(const Insertion& insertion, const model::NeedleParameters& needle, Compare compare,
                                   const Entry& entry = Entry::Zero());

ErrorFigures summarise(const Insertion& insertion, const std::vector<double>& errors_mm);
ErrorFigures error_figures(const std::vector<Insertion>& insertions, const model::NeedleParameters& needle,
                           Compare compare, const std::vector<Entry>& entries = {});

// Trials with the same commands, averaged measurement by measurement (Section IV compares with the mean of three).
// Throws ArgumentError if they do not have the same number of measurements.
Insertion mean_of_trials(const std::vector<Insertion>& trials);

}  // namespace bevel::diagnosis
