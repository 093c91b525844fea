#include "model/slip.hpp"

#include <cmath>
#include <numbers>

namespace bevel::model {

Slip evaluate_slip(double tilt_rad, double lambda1_per_rad, double lambda2) {
  constexpr Slip kOutside{0, 0, 0, 0, 0, 0, false};
  if (lambda1_per_rad == 0 && lambda2 == 0) {
    // The bicycle, to the last digit: f is exactly zero. The derivatives are those of the law, so that a filter that
    // starts at the bicycle still learns lambda.
    return {tilt_rad, 0, 0, 0, -tilt_rad * tilt_rad, tilt_rad, true};
  }
  const double b = 1 - lambda2;
  const double discriminant = b * b + 4 * lambda1_per_rad * tilt_rad;
  if (!(discriminant > 0) || !(b > 0)) return kOutside;
  const double root = std::sqrt(discriminant);  // = b + 2 lambda1 gamma = d theta/d gamma
  const double gamma = 2 * tilt_rad / (b + root);
  const double alpha = gamma - tilt_rad;
  if (!(gamma < std::numbers::pi / 2) || !(std::abs(alpha) < std::numbers::pi / 2)) return kOutside;
  const double f = std::tan(alpha);
  const double f_by_alpha = 1 + f * f;
  return {gamma, alpha, f, f_by_alpha * (1 / root - 1), -f_by_alpha * gamma * gamma / root, f_by_alpha * gamma / root,
          true};
}

}  // namespace bevel::model
