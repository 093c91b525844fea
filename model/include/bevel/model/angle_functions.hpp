// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Functions of an angle t in the exponentials of SO(3) and SE(3) and their Jacobians. All are even in t, so their
/// argument is t^2. They are inline because the integrator evaluates several of them per step.
#include <cmath>

/// Forces inlining. The stages of a step pass small vectors to each other; calls would stall on store forwarding. GCC's
/// size heuristic does not inline them.
#define BEVEL_IN_PLACE [[gnu::always_inline]] inline

namespace bevel::model {

/// Values of the functions at one angle t, rad.
struct AngleFunctions {
  double a;  ///< sin t / t
  double b;  ///< (1 - cos t) / t^2
  double c;  ///< (t - sin t) / t^3
  double d;  ///< (t^2/2 + cos t - 1) / t^4
  double e;  ///< (2 t - 3 sin t + t cos t) / (2 t^5)
};

/// Computes the functions at any angle: by power series below t^2 = 0.3, otherwise in closed form.
/// @param t2 squared angle, rad^2, >= 0
/// @return the values
inline AngleFunctions angle_functions_of_larger(double t2) {
  const double x = t2;
  if (x < 0.3) {
    const auto series = [x](double c0, double c1, double c2, double c3, double c4, double c5, double c6) {
      return c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * (c5 + x * c6)))));
    };
    return {
        series(1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800, 1.0 / 6227020800),
        series(1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320, 1.0 / 3628800, -1.0 / 479001600, 1.0 / 87178291200),
        series(1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880, 1.0 / 39916800, -1.0 / 6227020800, 1.0 / 1307674368000),
        series(1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800, 1.0 / 479001600, -1.0 / 87178291200,
               1.0 / 20922789888000),
        series(1.0 / 120, -2.0 / 5040, 3.0 / 362880, -4.0 / 39916800, 5.0 / 6227020800, -6.0 / 1307674368000,
               7.0 / 355687428096000)};
  }
  const double t = std::sqrt(t2);
  const double s = std::sin(t);
  const double c = std::cos(t);
  return {s / t, (1 - c) / t2, (t - s) / (t2 * t), (t2 / 2 + c - 1) / (t2 * t2),
          (2 * t - 3 * s + t * c) / (2 * t2 * t2 * t)};
}

/// Computes the functions, by a short power series for small angles. The closed forms lose digits by cancellation
/// there. The series is exact to rounding up to 2.5 degrees, which covers nearly all steps.
/// @param t2 squared angle, rad^2, >= 0
/// @return the values
BEVEL_IN_PLACE AngleFunctions angle_functions(double t2) {
  const double x = t2;
  if (!(x < 2e-3)) return angle_functions_of_larger(t2);
  const auto series = [x](double c0, double c1, double c2, double c3) { return c0 + x * (c1 + x * (c2 + x * c3)); };
  return {series(1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040), series(1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320),
          series(1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880),
          series(1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800),
          series(1.0 / 120, -2.0 / 5040, 3.0 / 362880, -4.0 / 39916800)};
}

}  // namespace bevel::model
