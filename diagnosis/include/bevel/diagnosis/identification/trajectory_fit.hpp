// SPDX-License-Identifier: MIT
#pragma once
// Maximum likelihood of the needle's parameters on measured tip positions, through the integrated model, over all
// insertions at once.
//
// Problem
//   minimise  sum_ij rho(w_ij (p_ij - model(q, e_i)) / s)  +  sum ((q - mean)/sigma)^2 / 2  +  sum (e_i/sigma)^2 / 2
//   over q, a subset of (k, lambda1, lambda2, ell), and, where asked for, the entry e_i of each insertion i (tilt,
//   roll, offset, late entry: nuisance with a Gaussian prior about nominal). w is the measurement's whitening, rho
//   Huber's loss or the square, s the scale of the noise against what the measurements claim, found with the fit.
//   Constraints: the model's domain, (23), (24), (26). (26) is kept by fitting lambda1 - lambda2^2/(2 pi) >= 0.
// Solution
//   Levenberg-Marquardt with analytic Jacobians, weights renewed each iteration (IRLS), bounds by an active set; where
//   entries are asked for, from there to the least of twice that and log det of the entries' own part of the normal
//   equations, which integrates them out (reason: bevel/diagnosis/inference/own_volume.hpp).
// Result
//   Estimate, covariance (Huber 1981, 7.6, for the loss; multiplied by (1 + rho)/(1 - rho) where successive residuals
//   correlate, because a camera's error is not white), and what the data do not fix (fit_statistics.hpp).
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/path.hpp>

namespace bevel::diagnosis {

struct Prior {
  double mean;
  double sigma;
};
using Priors = std::array<std::optional<Prior>, kNeedleParameters>;

// Table I as a prior on the lambdas: a tissue's row, with half the distance between the two tissues as sigma.
Priors table_one_agar();
Priors table_one_plastisol();

// Standard deviations of the entry about nominal, by EntryParameter; 0 holds it there.
using EntrySigma = Entry;

enum class Loss { square, huber };

struct FitOptions {
  model::NeedleParameters start;  // values to begin with; those not fitted stay
  std::array<bool, kNeedleParameters> fitted{true, true, true,
                                             false};  // ell trades off with k and lambda2: see physics
  Priors priors;
  EntrySigma entry_sigma = EntrySigma::Zero();
  Loss loss = Loss::huber;
  double huber_threshold = 2.0;     // in standard deviations: 98 % efficient on Gaussian noise
  bool estimate_scale = true;       // else s = 1: the measurements' covariances are believed
  bool correct_correlation = true;  // widen the covariance where residuals correlate in time
  bool fit_slip_in_plane = false;   ///< read by fit_determined() only
  int max_iterations = 60;
  double tolerance = 1e-8;  // relative, on cost and on step
  int threads = 1;
};

// One eigenvector of the data's information about the fitted parameters, in units of what is plausible for each.
struct Direction {
  Eigen::VectorXd weights;  // unit vector over the fitted parameters, each in its plausible unit
  double sigma;             // standard deviation along it by the data alone, same units; above 1: not fixed by the data
};

struct FittedParameter {
  Parameter parameter;
  double value;
  double std_error;
  double data_std_error;  ///< by the data alone, without priors; at most 1e6 plausible ranges
  double low95, high95;
  double prior_share;  // of the estimate's weight that is the prior's, in [0, 1]
  bool at_bound;       // of the model's domain: its error is then not to be believed
};

/// A parameter that was to be fitted and that the recordings do not determine: it stays at its value beforehand.
struct HeldParameter {
  Parameter parameter;
  double value;
  bool by_prior;       ///< the value is the prior's mean; false: the model file's
  std::string reason;  ///< clause for a report
};

struct FitResult {
  model::NeedleParameters needle;
  std::vector<FittedParameter> parameters;
  std::vector<HeldParameter> held;  ///< by fit_determined(); the other fits hold nothing
  Eigen::MatrixXd covariance;       // of the fitted needle parameters, in their order
  Eigen::MatrixXd correlation;
  std::vector<Direction> directions;  // best fixed first
  std::vector<Entry> entries;         // one per insertion
  double noise_scale = 1;             // s
  double lag1_correlation = 0;        // of the whitened residuals in time
  double cost = 0;                    // as in the problem above
  double prior_cost = 0;              // the part of it that is the priors
  double deviance = 0;                // min over s of n log s + sum rho(r/s): what compares fits of the same data
  double squares = 0;                 // sum of squared whitened residuals
  int residual_count = 0;
  int iterations = 0;
  bool converged = false;

  [[nodiscard]] int unfixed_directions() const;
  [[nodiscard]] const FittedParameter* find(Parameter parameter) const;
};

// Throws ArgumentError for no insertion, a start outside the model's domain, a sigma that is not positive or a
// start from which the model cannot follow the insertions.
FitResult fit_trajectory(const std::vector<Insertion>& insertions, const FitOptions& options);

// The same from several starts (the options', Table I's two, the fitted bicycle), the best of them: with lambda the
// likelihood can have more than one hill.
FitResult fit_from_many_starts(const std::vector<Insertion>& insertions, const FitOptions& options);

/// Least roll, rad, between two parts of an insertion that separates slip from other deviations of the path.
/// Entries on real rigs are uncertain by 0.1 rad; a smaller rotation leaves one plane of motion.
inline constexpr double kSeparatingRoll_rad = 0.1;

/// Returns whether an insertion rotates the shaft by kSeparatingRoll_rad while it inserts.
bool separate_slip(const std::vector<Insertion>& insertions);

/// Fits as fit_from_many_starts() and holds the parameters that the recordings do not determine.
///
/// The lambdas are held unless separate_slip(): in one plane any
/// smooth deviation of the path is confounded with slip, however small the standard error is. Of lambda1, lambda2 and
/// ell, those with a standard error by the data alone above the prior's (without prior: above the plausible range) are
/// held as well, the least determined first, with a new fit after each. The curvature is always estimated.
///
/// @param options.fit_slip_in_plane fits the lambdas of insertions without rotation all the same
/// @return the fit; FitResult::held lists what was held, at the prior's mean or else at the value of options.start
/// @throws ArgumentError as fit_trajectory()
FitResult fit_determined(const std::vector<Insertion>& insertions, const FitOptions& options);

}  // namespace bevel::diagnosis
