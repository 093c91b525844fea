// SPDX-License-Identifier: MIT
#pragma once
// The slip law (25) as a function of the tilt, in closed form, with its derivatives.
#include <cmath>
#include <numbers>

#include <bevel/model/angle_functions.hpp>
#include <bevel/model/needle.hpp>

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

// The law at tilts near one at which it is already known, to rounding the same as evaluate_slip(): without its roots
// and its tangent where the change is small, as it is between the stages of a step.
class SlipNear {
 public:
  SlipNear(const Slip& known, double lambda1_per_rad, double lambda2)
      : known_(known),
        lambda1_per_rad_(lambda1_per_rad),
        lambda2_(lambda2),
        by_root_(1 + known.f_by_tilt_per_rad / (1 + known.f * known.f)) {}

  Slip at(double tilt_rad) const { return evaluate_slip(tilt_rad, lambda1_per_rad_, lambda2_); }

  // The sine of the change of tilt, which is less than 90 degrees.
  BEVEL_IN_PLACE Slip at_change(double sine) const {
    constexpr double kShort = 3e-3;
    const double s2 = sine * sine;
    const double change = sine * (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40)));
    // gamma and d gamma/d tilt = 1/root in powers of z: Catalan's numbers, as of every root of a quadratic.
    const double z = lambda1_per_rad_ * by_root_ * by_root_ * change;
    if (!(std::abs(sine) < kShort) || !(std::abs(z) < kShort) || (lambda1_per_rad_ == 0 && lambda2_ == 0))
      return at_larger_change(sine);
    const double gamma_change = by_root_ * change * (1 + z * (-1 + z * (2 + z * (-5 + z * (14 - 42 * z)))));
    const double by_root = by_root_ * (1 + z * (-2 + z * (6 + z * (-20 + z * (70 - 252 * z)))));
    const double alpha_change = gamma_change - change;
    const double c2 = alpha_change * alpha_change;
    const double tangent = alpha_change * (1 + c2 * (1.0 / 3 + c2 * (2.0 / 15)));
    const double gamma = known_.gamma_rad + gamma_change;
    if (!(gamma < std::numbers::pi / 2)) return at_larger_change(sine);
    const double f = (known_.f + tangent) / (1 - known_.f * tangent);
    const double f_by_alpha = 1 + f * f;
    const double f_by_gamma = f_by_alpha * by_root;
    return {gamma,
            known_.alpha_rad + alpha_change,
            f,
            f_by_gamma - f_by_alpha,
            -f_by_gamma * gamma * gamma,
            f_by_gamma * gamma,
            true};
  }

 private:
  Slip at_larger_change(double sine) const;

  const Slip& known_;
  double lambda1_per_rad_, lambda2_;
  double by_root_;  // 1/root of what is known
};

}  // namespace bevel::model
