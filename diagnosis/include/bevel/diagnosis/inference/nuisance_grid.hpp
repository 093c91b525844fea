// SPDX-License-Identifier: MIT
#pragma once
// Combinations of the standard deviations that the groups of nuisances may have.
#include <functional>

#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference {

// Every combination of the groups' standard deviations, one column each, and the logarithms of their probabilities.
struct NuisanceGrid {
  Eigen::MatrixXd standard_deviations;
  Eigen::VectorXd log_prior;
};
NuisanceGrid nuisance_grid(const System& system);
// Of a posterior over it: a combination of less than this, a thousandth of the likeliest, is left out of sums.
double negligible_of(const Eigen::VectorXd& weights);
// Recordings do not differ at all, as in a simulation or where one was copied, with probability one half; else each
// group's standard deviation is any of its values, 0 among them. What differs between repetitions differs in most
// ways: that all stay alike in every way but one is what something else would make of them.
double log_prior_of_spread(const System& system, const Eigen::VectorXd& nuisance_sd);
// The middle of each group's values.
Eigen::VectorXd middle_nuisance_sd(const System& system);
// The same with one group at none, for each that is not, and, of several, with all of them at none.
std::vector<Eigen::VectorXd> less_spread(const Eigen::VectorXd& nuisance_sd);
// The same with one group at its next smaller value, for each that is not at none.
std::vector<Eigen::VectorXd> one_step_less_spread(const System& system, const Eigen::VectorXd& nuisance_sd);
// Which of its columns this is; each is one of its group's standard deviations.
Eigen::Index column_of(const System& system, const Eigen::VectorXd& nuisance_sd);
// How far apart two of its columns are: steps of the group that differs most.
Eigen::Index apart(const System& system, Eigen::Index a, Eigen::Index b);

// A logarithm for each combination of nuisance_grid(), by `log_at` of its column; -infinity for those that were not
// asked for: only neighbours (one group's next standard deviation, either way) of what comes within exp(-far_below) of
// the likeliest are, beginning with `start`, a column too, with no spread, and with the middle of each. Of a density
// with one peak beside that at no spread nothing is missed that counts; with 0 the way up from the likeliest
// of these, and what lies beside its end.
Eigen::VectorXd over_likely(const System& system, Eigen::Index start, double far_below,
                            const std::function<double(Eigen::Index)>& log_at);

}  // namespace bevel::inference
