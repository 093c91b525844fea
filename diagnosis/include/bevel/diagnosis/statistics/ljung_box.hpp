// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Ljung-Box test for white noise: Ljung and Box, "On a measure of lack of fit in time series models", Biometrika
/// 65(2), 1978.
#include <Eigen/Core>

namespace bevel::diagnosis {

/// Result of the Ljung-Box test.
struct LjungBox {
  /// Q = n (n + 2) sum over j = 1..lags of r_j^2 / (n - j), with r_j the autocorrelation at lag j.
  double statistic = 0;
  int lags = 0;        ///< number of lags
  double p_value = 1;  ///< probability of a larger Q for white noise, by the chi-square distribution
};

/// Computes the Ljung-Box test of a series. The mean of the series is subtracted.
/// @param series equally spaced values, in any unit
/// @param lags number of lags
/// @param fitted number of coefficients of the noise model that were fitted to the series; the chi-square distribution
///   has lags - fitted degrees of freedom, at least one
/// @return statistic and p-value; the p-value is 1 for a series of no more than lags values or of identical values
LjungBox ljung_box(const Eigen::Ref<const Eigen::VectorXd>& series, int lags, int fitted = 0);

}  // namespace bevel::diagnosis
