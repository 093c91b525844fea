// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Slip law (25) as a closed-form function of the tilt, with its derivatives.
#include <cmath>
#include <numbers>

#include <bevel/model/angle_functions.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::model {

/// Slip at a tilt theta >= 0. For theta < 0 the caller uses the odd extension. Here gamma is the direction of motion of
/// the tip, alpha = gamma - theta the slip angle and f = tan(alpha). All other fields are zero if in_domain is false.
struct Slip {
  double gamma_rad;          ///< angle between the tip's direction of motion and z_A, rad
  double alpha_rad;          ///< slip angle, rad
  double f;                  ///< tan(alpha): ratio of the lateral to the forward velocity of the tip
  double f_by_tilt_per_rad;  ///< df/dtheta, 1/rad
  double f_by_lambda1_rad;   ///< df/dlambda1, rad
  double f_by_lambda2;       ///< df/dlambda2, dimensionless
  bool in_domain;            ///< false if no real gamma exists, or gamma or |alpha| is 90 degrees or more
};

/// Evaluates the slip law (25) at one tilt. gamma solves
/// theta = gamma - alpha(gamma) = (1 - lambda2) gamma + lambda1 gamma |gamma|.
/// With lambda1 = lambda2 = 0 (the bicycle) f is exactly zero; the derivatives remain those of the law.
/// @param tilt_rad tilt theta of the heading, rad, >= 0
/// @param lambda1_per_rad lambda1 of (25), 1/rad
/// @param lambda2 lambda2 of (25), dimensionless
/// @return the slip and its derivatives; in_domain is false outside the domain of (25)
Slip evaluate_slip(double tilt_rad, double lambda1_per_rad, double lambda2);

/// Evaluates the slip law near a tilt at which the slip is known. The result equals that of evaluate_slip() to
/// rounding. For small changes, as between the stages of a step, power series replace the square root and the tangent.
class SlipNear {
 public:
  /// Stores the expansion point.
  /// @param known slip at the expansion point; in_domain must be true, and the object must outlive this one
  /// @param lambda1_per_rad lambda1 of (25) for which \p known was evaluated, 1/rad
  /// @param lambda2 lambda2 of (25) for which \p known was evaluated
  SlipNear(const Slip& known, double lambda1_per_rad, double lambda2)
      : known_(known),
        lambda1_per_rad_(lambda1_per_rad),
        lambda2_(lambda2),
        by_root_(1 + known.f_by_tilt_per_rad / (1 + known.f * known.f)) {}

  /// Evaluates the slip law at any tilt, by evaluate_slip().
  /// @param tilt_rad tilt of the heading, rad, >= 0
  /// @return the slip at that tilt
  Slip at(double tilt_rad) const { return evaluate_slip(tilt_rad, lambda1_per_rad_, lambda2_); }

  /// Evaluates the slip law at the tilt of the expansion point plus a change.
  /// @param sine sine of the change of tilt; the change is below 90 degrees in magnitude
  /// @return the slip at the changed tilt
  BEVEL_IN_PLACE Slip at_change(double sine) const {
    constexpr double kShort = 3e-3;
    const double s2 = sine * sine;
    const double change = sine * (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40)));
    // Power series of gamma and d gamma/d tilt = 1/root in z. The coefficients follow from the Catalan numbers.
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
  double by_root_;  // d gamma/d tilt at the expansion point
};

}  // namespace bevel::model
