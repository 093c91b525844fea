// SPDX-License-Identifier: MIT
/// @file
/// Combinations of the between-insertion standard deviations.
#pragma once
#include <functional>

#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference {

/// All combinations of the groups' standard deviations.
struct NuisanceGrid {
  Eigen::MatrixXd standard_deviations;  ///< One row per group, one column per combination.
  Eigen::VectorXd log_prior;            ///< Natural log prior probability of each combination.
};
/// Makes the grid of a system.
/// @param system Model.
/// @return Grid.
NuisanceGrid nuisance_grid(const System& system);
/// Computes the weight below which a combination is left out of sums: a thousandth of the largest.
/// @param weights Posterior over the grid.
/// @return Limit; 0 if \p weights is empty.
double negligible_of(const Eigen::VectorXd& weights);
/// Computes the log prior of a combination.
///
/// With probability 0.5 the recordings do not differ at all, as in a simulation or for copies. Otherwise all values of
/// each group, 0 among them, are equally likely: real repetitions usually differ in most ways.
/// @param system Model.
/// @param nuisance_sd Standard deviation per group.
/// @return Natural log.
double log_prior_of_spread(const System& system, const Eigen::VectorXd& nuisance_sd);
/// Selects the middle value of each group.
/// @param system Model.
/// @return Standard deviation per group.
Eigen::VectorXd middle_nuisance_sd(const System& system);
/// Lists the combinations with one non-zero group set to zero, and, if several groups are not zero, with all at zero.
/// @param nuisance_sd Standard deviation per group.
/// @return Combinations.
std::vector<Eigen::VectorXd> less_spread(const Eigen::VectorXd& nuisance_sd);
/// Lists the combinations with one non-zero group at its next smaller value.
/// @param system Model.
/// @param nuisance_sd Standard deviation per group.
/// @return Combinations.
std::vector<Eigen::VectorXd> one_step_less_spread(const System& system, const Eigen::VectorXd& nuisance_sd);
/// Finds the column of a combination.
/// @param system Model.
/// @param nuisance_sd Standard deviation per group; each must be a value of its group.
/// @return Column of nuisance_grid().
Eigen::Index column_of(const System& system, const Eigen::VectorXd& nuisance_sd);
/// Computes the distance of two columns.
/// @param system Model.
/// @param a First column.
/// @param b Second column.
/// @return Grid steps of the group that differs most.
Eigen::Index apart(const System& system, Eigen::Index a, Eigen::Index b);

/// Evaluates a log density on the likely part of nuisance_grid().
///
/// Evaluation starts at \p start, at zero, and at the middle of each group. It continues with the neighbours (one
/// group's next value) of each column within exp(-far_below) of the largest. This finds all that matters of a density
/// with one peak in addition to the one at zero. With \p far_below 0 it follows only the ascent from the most likely of
/// these and the neighbours of its end.
/// @param system Model.
/// @param start First column.
/// @param far_below Depth below the largest log density, not negative.
/// @param log_at Log density of a column.
/// @return Log density of each column; -infinity for columns that were not evaluated.
Eigen::VectorXd over_likely(const System& system, Eigen::Index start, double far_below,
                            const std::function<double(Eigen::Index)>& log_at);

}  // namespace bevel::inference
