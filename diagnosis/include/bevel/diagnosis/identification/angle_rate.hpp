// SPDX-License-Identifier: MIT
#pragma once
// The identification of Section IV, as printed: kept for comparison, not for use (it differentiates noise).
//
// For each insertion cubic polynomials of time are fitted to depth and deflection (and to the axis's insertion, whose
// derivative is u1); the angle of motion is gamma = asin(dy/dd), (28), with dd the path's increment; its rate is fitted
// to (17) for lambda1 and lambda2 by nonlinear least squares (lsqcurvefit there, Ceres here), at given k and ell. The
// same fit of (17) with k as a third unknown is there as well, since the paper does not print k.
// Planar: the insertions must not turn the shaft.
#include <string>
#include <vector>

#include <bevel/diagnosis/identification/insertion.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::diagnosis {

struct AngleRateResult {
  model::NeedleParameters needle;
  double rate_rms_rad_s = 0;  // residual of (17) on the polynomials' rate
  bool converged = false;
  bool in_domain = false;  // (23), (24), (26): the fit as printed does not ask for it
  std::string message;     // of the solver
};

// `start` gives k, ell, front wheel and the lambdas to begin with. Throws ArgumentError where an insertion
// turns the shaft by more than 0.02 rad, has fewer than 8 measurements, or does not advance.
AngleRateResult fit_angle_rate(const std::vector<Insertion>& insertions, const model::NeedleParameters& start,
                               bool fit_curvature = false);

}  // namespace bevel::diagnosis
