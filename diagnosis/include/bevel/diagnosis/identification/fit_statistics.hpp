// SPDX-License-Identifier: MIT
#pragma once
// What a fit's information matrix says: covariance, prior's share, and the directions that the data leave open.
#include <bevel/diagnosis/identification/trajectory_fit.hpp>

namespace bevel::diagnosis {

// Range that each parameter may plausibly have (one sigma), the unit in which "fixed by the data" is judged:
// k 0.002 /mm, lambda1 0.2 /rad, lambda2 0.1, ell 10 mm. The two lambdas' are the differences between Table I's
// tissues.
inline constexpr std::array<double, kNeedleParameters> kPlausibleRange = {0.002, 0.2, 0.1, 10.0};

// Factor on the information JtJ/s^2 for Huber's loss (1981, 7.6): mean(psi')^2 / mean(psi^2).
double huber_efficiency(const std::vector<double>& scaled_residuals, double threshold);

// Of residuals taken one after the other; `series` are offsets into `residuals` where a new series begins, the last is
// the size. 0 when it is inside what white noise gives (2/sqrt(n)).
double lag1_correlation(const std::vector<double>& residuals, const std::vector<std::size_t>& series);

// 1.4826 times the median absolute value: the standard deviation of Gaussian noise, deaf to outliers. Reorders.
double robust_scale(std::vector<double>& residuals);

// min over s of n log s + sum rho(r/s), rho Huber's loss (an infinite threshold: the square).
double deviance(const std::vector<double>& residuals, double threshold);

// From the information of the data (entry parameters already marginalised out) fills covariance, correlation,
// directions and the parameters' errors. `free[i]` is false for a parameter at a bound.
void fill_uncertainty(const Eigen::MatrixXd& data_information, const std::vector<Parameter>& parameters,
                      const std::vector<bool>& free, const Priors& priors, FitResult& result);

}  // namespace bevel::diagnosis
