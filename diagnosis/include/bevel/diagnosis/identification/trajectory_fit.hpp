// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Estimates the needle's parameters by maximum likelihood from measured tip positions, over all insertions at once.
///
/// Problem:
/// \code{.unparsed}
///   minimise  sum_ij rho(w_ij (p_ij - model(q, e_i)) / s)  +  sum ((q - mean)/sigma)^2 / 2  +  sum (e_i/sigma)^2 / 2
/// \endcode
/// over q, a subset of (k, lambda1, lambda2, ell), and, if requested, the entry e_i of each insertion i. The entry
/// (tilt, roll, offset, late entry) is a nuisance parameter with a Gaussian prior about nominal. w is the measurement's
/// whitening. rho is Huber's loss or the square. s is the ratio of the noise to the noise that the measurements state;
/// it is estimated with the fit. Constraints: the model's domain, Eqs. (23), (24), (26). Eq. (26) holds by the
/// parameter lambda1 - lambda2^2/(2 pi) >= 0.
///
/// Solution: Levenberg-Marquardt with analytic Jacobians, iteratively reweighted least squares (IRLS), bounds by an
/// active set. If entries are estimated, the solver then minimises twice that cost plus log det of the entries' blocks
/// of the normal equations, which marginalises over the entries (bevel/diagnosis/inference/own_volume.hpp).
///
/// Result: estimate, covariance and the directions that the data do not determine (fit_statistics.hpp). The covariance
/// accounts for the loss (Huber, Robust Statistics, 1981, section 7.6). It is multiplied by (1 + rho)/(1 - rho) with
/// rho the correlation of successive residuals, because a camera's error is not white.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/path.hpp>

namespace bevel::diagnosis {

/// Gaussian prior of one parameter, in the parameter's unit.
struct Prior {
  double mean;   ///< mean
  double sigma;  ///< standard deviation, positive
};
/// Priors by Parameter; null: no prior.
using Priors = std::array<std::optional<Prior>, kNeedleParameters>;

/// Returns the row for agar of Table I as a prior on both lambda.
/// @return means of Table I; the standard deviation is half the difference between the two tissues
Priors table_one_agar();
/// Returns the row for plastisol of Table I as a prior on both lambda.
/// @return means of Table I; the standard deviation is half the difference between the two tissues
Priors table_one_plastisol();

/// Standard deviations of the entry about nominal, by EntryParameter, in the units of Entry; 0 fixes the parameter.
using EntrySigma = Entry;

/// Loss function of the whitened residuals.
enum class Loss {
  square,  ///< square, for Gaussian noise
  huber    ///< Huber's loss, robust to outliers
};

/// Options of the fits.
struct FitOptions {
  model::NeedleParameters start;  ///< start values; parameters that are not fitted keep them
  std::array<bool, kNeedleParameters> fitted{
      true, true, true, false};  ///< which are fitted, by Parameter; not ell: it is confounded with k and lambda2
  Priors priors;                 ///< priors of the needle's parameters
  EntrySigma entry_sigma = EntrySigma::Zero();  ///< priors of the entries
  Loss loss = Loss::huber;                      ///< loss function
  double huber_threshold = 2.0;                 ///< in standard deviations; 2: 98 % efficient on Gaussian noise
  bool estimate_scale = true;       ///< whether s is estimated; false: s = 1, the stated covariances are exact
  bool correct_correlation = true;  ///< whether correlation of successive residuals enlarges the covariance
  bool fit_slip_in_plane = false;   ///< whether fit_determined() fits both lambda without rotation
  int max_iterations = 60;          ///< largest number of iterations
  double tolerance = 1e-8;          ///< relative tolerance on cost and on step
  int threads = 1;                  ///< number of threads
};

/// One eigenvector of the data's information about the fitted parameters. Each parameter has as its unit the standard
/// deviation of its prior; without prior, its plausible range (kPlausibleRange).
struct Direction {
  Eigen::VectorXd weights;  ///< unit vector over the fitted parameters
  double sigma;             ///< standard deviation along it by the data alone; above 1: not determined by the data
};

/// Estimate of one parameter, in the parameter's unit.
struct FittedParameter {
  Parameter parameter;    ///< the parameter
  double value;           ///< estimate
  double std_error;       ///< standard error, priors included
  double data_std_error;  ///< standard error by the data alone, without priors; at most 1e6 plausible ranges
  double low95,           ///< lower limit of the 95 % interval
      high95;             ///< upper limit of the 95 % interval
  double prior_share;     ///< share of the prior in the estimate's weight, in [0, 1]
  bool at_bound;          ///< whether it lies at a bound of the model's domain; its standard error is then not valid
};

/// A parameter that was to be fitted and that the recordings do not determine: it keeps its value from before the fit.
struct HeldParameter {
  Parameter parameter;  ///< the parameter
  double value;         ///< its value, in the parameter's unit
  bool by_prior;        ///< whether the value is the prior's mean; false: the start value of the model file
  std::string reason;   ///< clause for a report
};

/// Result of a fit.
struct FitResult {
  model::NeedleParameters needle;           ///< estimates, with the parameters that are not fitted
  std::vector<FittedParameter> parameters;  ///< the fitted parameters
  std::vector<HeldParameter> held;          ///< filled by fit_determined(); empty for the other fits
  Eigen::MatrixXd covariance;               ///< of the fitted needle parameters, in their order
  Eigen::MatrixXd correlation;              ///< of the fitted needle parameters, in their order
  std::vector<Direction> directions;        ///< best determined first
  std::vector<Entry> entries;               ///< one per insertion
  double noise_scale = 1;                   ///< s
  double lag1_correlation = 0;              ///< correlation of successive whitened residuals in time
  double cost = 0;                          ///< minimum of the problem above
  double prior_cost = 0;                    ///< part of cost that belongs to the priors
  double deviance = 0;     ///< min over s of n log s + sum rho(r/s); comparable between fits of identical data
  double squares = 0;      ///< sum of squared whitened residuals
  int residual_count = 0;  ///< number of scalar residuals
  int iterations = 0;      ///< number of iterations
  bool converged = false;  ///< whether the tolerance was reached

  /// Counts the directions that the data do not determine.
  /// @return number of directions with Direction::sigma above 1
  [[nodiscard]] int unfixed_directions() const;
  /// Finds the estimate of a parameter.
  /// @param parameter the parameter
  /// @return pointer into parameters; null if it was not fitted
  [[nodiscard]] const FittedParameter* find(Parameter parameter) const;
};

/// Fits the needle's parameters from one start.
/// @param insertions at least one insertion
/// @param options start values, priors and settings of the solver
/// @return estimates and their uncertainty
/// @throws bevel::ArgumentError if there is no insertion, the start lies outside the model's domain, a sigma is not
///   positive, or the model cannot follow the insertions from the start
FitResult fit_trajectory(const std::vector<Insertion>& insertions, const FitOptions& options);

/// Fits as fit_trajectory() from several starts: options.start, the two rows of Table I and the fitted bicycle model.
/// With both lambda the likelihood can have several maxima.
/// @param insertions at least one insertion
/// @param options as for fit_trajectory()
/// @return the best fit
/// @throws bevel::ArgumentError as fit_trajectory(), if no start leads to a fit
FitResult fit_from_many_starts(const std::vector<Insertion>& insertions, const FitOptions& options);

/// Least roll, rad, between two parts of an insertion that separates slip from other deviations of the path.
/// Entries on real rigs are uncertain by 0.1 rad; a smaller rotation leaves one plane of motion.
inline constexpr double kSeparatingRoll_rad = 0.1;

/// Returns whether an insertion rotates the shaft by kSeparatingRoll_rad while it inserts.
/// @param insertions any number of insertions
/// @return true if the roll_range_rad() of at least one reaches it
bool separate_slip(const std::vector<Insertion>& insertions);

/// Fits as fit_from_many_starts() and holds the parameters that the recordings do not determine.
///
/// Both lambda are held unless separate_slip(): in one plane any smooth deviation of the path is confounded with slip,
/// however small the standard error is. FitOptions::fit_slip_in_plane disables this rule. Of lambda1, lambda2 and ell,
/// those with a standard error by the data alone above the prior's (without prior: above the plausible range) are held
/// as well, the least determined first, with a new fit after each. The curvature is always estimated.
///
/// @param insertions at least one insertion
/// @param options as for fit_trajectory()
/// @return the fit; FitResult::held lists the held parameters, at the prior's mean or else at the value of
/// options.start
/// @throws bevel::ArgumentError as fit_trajectory()
FitResult fit_determined(const std::vector<Insertion>& insertions, const FitOptions& options);

}  // namespace bevel::diagnosis
