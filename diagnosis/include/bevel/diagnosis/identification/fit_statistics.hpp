// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Computes the statistics of a fit from its information matrix and residuals: covariance, share of the priors, and the
/// directions that the data do not determine.
#include <bevel/diagnosis/identification/trajectory_fit.hpp>

namespace bevel::diagnosis {

/// Plausible range of each parameter (one standard deviation), by Parameter: k 0.002 1/mm, lambda1 0.2 1/rad, lambda2
/// 0.1, ell 10 mm. A parameter without prior is determined by the data if its standard error is smaller. The ranges of
/// both lambda follow from the differences between the tissues of Table I.
inline constexpr std::array<double, kNeedleParameters> kPlausibleRange = {0.002, 0.2, 0.1, 10.0};

/// Computes the factor mean(psi')^2 / mean(psi^2) on the information J^T J / s^2 for Huber's loss (Huber, Robust
/// Statistics, 1981, section 7.6).
/// @param scaled_residuals residuals in standard deviations
/// @param threshold threshold of the loss, in standard deviations
/// @return the factor; 1 if all residuals are zero
double huber_efficiency(const std::vector<double>& scaled_residuals, double threshold);

/// Computes the correlation of successive residuals.
/// @param residuals residuals of all series, in order of time
/// @param series offsets into residuals at which a series begins; the last one is the number of residuals
/// @return correlation, -0.99 to 0.99; 0 if it is within the range of white noise, 2/sqrt(n)
double lag1_correlation(const std::vector<double>& residuals, const std::vector<std::size_t>& series);

/// Computes a robust standard deviation: 1.4826 times the median absolute value, consistent for Gaussian noise.
/// @param residuals at least one residual; reordered and replaced by absolute values
/// @return standard deviation, in the unit of the residuals
double robust_scale(std::vector<double>& residuals);

/// Computes the minimum over s of n log s + sum rho(r/s), with rho Huber's loss.
/// @param residuals n residuals
/// @param threshold threshold of the loss in units of s; infinite: the square
/// @return the minimum; -1e300 if all residuals are zero
double deviance(const std::vector<double>& residuals, double threshold);

/// Computes covariance, correlation, directions and standard errors of a fit.
/// @param data_information information of the data about the parameters, marginalised over the entries
/// @param parameters the fitted parameters, in the order of data_information
/// @param free one per parameter; false: at a bound, the others are conditional on its value
/// @param priors priors by Parameter
/// @param result fit with FitResult::needle set; receives the statistics
void fill_uncertainty(const Eigen::MatrixXd& data_information, const std::vector<Parameter>& parameters,
                      const std::vector<bool>& free, const Priors& priors, FitResult& result);

}  // namespace bevel::diagnosis
