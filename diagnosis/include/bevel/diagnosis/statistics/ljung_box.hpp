// SPDX-License-Identifier: MIT
#pragma once
// Is a series white? Ljung and Box 1978, "On a measure of lack of fit in time series models", Biometrika 65(2).
#include <Eigen/Core>

namespace bevel::diagnosis {

struct LjungBox {
  double statistic = 0;  // Q = n (n + 2) sum over j = 1..lags of r_j^2 / (n - j), r_j the autocorrelation at lag j
  int lags = 0;
  double p_value = 1;  // of Q under chi-square, were the series white
};

// Of equally spaced values in any unit; their mean is taken off. `fitted` counts the coefficients of the noise model
// that were fitted to the series: chi-square has lags - fitted degrees of freedom, at least one. A series of no more
// than `lags` values, or of equal ones, says nothing: p is 1.
LjungBox ljung_box(const Eigen::Ref<const Eigen::VectorXd>& series, int lags, int fitted = 0);

}  // namespace bevel::diagnosis
