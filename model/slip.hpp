#pragma once
// The slip law (25) as a function of the tilt, in closed form, with its derivatives.
#include "model/needle.hpp"

namespace bevel::model {

// For a tilt theta >= 0 (the odd extension serves the other side): gamma, alpha = gamma - theta, f = tan(alpha),
// and the derivatives of f that the integrator needs.
struct Slip {
  double gamma_rad;
  double alpha_rad;
  double f;                  // tan(alpha): lateral over forward velocity of the tip
  double f_by_tilt_per_rad;  // df/dtheta
  double f_by_lambda1_rad;   // df/dlambda1
  double f_by_lambda2;       // df/dlambda2
  bool in_domain;  // false: no real gamma, or gamma or alpha at or past 90 degrees; the other fields are then zero
};

// gamma solves theta = gamma - alpha(gamma) = (1 - lambda2) gamma + lambda1 gamma |gamma|, from (25).
Slip evaluate_slip(double tilt_rad, double lambda1_per_rad, double lambda2);

}  // namespace bevel::model
