// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Implements the identification method of Section IV of the paper, for comparison. It is not recommended for use,
/// because it differentiates noise.
///
/// Cubic polynomials of time are fitted to the depth, the deflection and the actuator insertion of each insertion. The
/// derivative of the latter is u1. The angle of motion is gamma = asin(dy/dd), Eq. (28), with dd the path's increment.
/// Its rate is fitted to Eq. (17) for lambda1 and lambda2 at given k and ell, by nonlinear least squares (lsqcurvefit
/// in the paper, Ceres here). Because the paper does not print k, a fit with k as a third unknown is available. The
/// method is planar: the insertions must not turn the shaft.
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/insertion.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::diagnosis {

/// Result of fit_angle_rate().
struct AngleRateResult {
  model::NeedleParameters needle;  ///< estimates, with the parameters that are not fitted
  double rate_rms_rad_s = 0;       ///< root mean square residual of Eq. (17) on the polynomials' rate
  bool converged = false;          ///< whether the solver converged
  bool in_domain = false;          ///< whether Eqs. (23), (24), (26) hold; the method does not enforce them
  std::string message;             ///< message of the solver
};

/// Fits lambda1 and lambda2 to the rate of the angle of motion, Eq. (17).
/// @param insertions at least one insertion
/// @param start k, ell, front wheel, and start values of both lambda
/// @param fit_curvature whether k is fitted as well
/// @return estimates and state of the solver
/// @throws bevel::ArgumentError if there is no insertion, or one turns the shaft by more than 0.02 rad, has fewer than
/// 8
///   measurements or does not advance
AngleRateResult fit_angle_rate(const std::vector<Insertion>& insertions, const model::NeedleParameters& start,
                               bool fit_curvature = false);

}  // namespace bevel::diagnosis
