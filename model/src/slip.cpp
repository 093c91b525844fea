// SPDX-License-Identifier: MIT
#include <bevel/model/slip.hpp>

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

// The angle between the tilts and the change of tan(alpha) are still short series; beyond, the law from the start.
Slip SlipNear::at_larger_change(double sine) const {
  constexpr double kNear = 0.03;
  const double known_tilt = known_.gamma_rad - known_.alpha_rad;
  if (!(std::abs(sine) < kNear)) return at(known_tilt + std::asin(sine));
  const double s2 = sine * sine;
  const double tilt = known_tilt + sine * (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336))));
  if (lambda1_per_rad_ == 0 && lambda2_ == 0) return at(tilt);
  const double b = 1 - lambda2_;
  const double root = std::sqrt(b * b + 4 * lambda1_per_rad_ * tilt);
  const double gamma = 2 * tilt / (b + root);
  const double alpha = gamma - tilt;
  const double change = alpha - known_.alpha_rad;
  if (!(gamma < std::numbers::pi / 2) || !(std::abs(change) < kNear)) return at(tilt);  // for a NaN too
  const double c2 = change * change;
  const double tangent = change * (1 + c2 * (1.0 / 3 + c2 * (2.0 / 15 + c2 * (17.0 / 315))));
  const double f = (known_.f + tangent) / (1 - known_.f * tangent);
  const double f_by_alpha = 1 + f * f;
  const double by_root = f_by_alpha / root;
  return {gamma, alpha, f, by_root - f_by_alpha, -by_root * gamma * gamma, by_root * gamma, true};
}

}  // namespace bevel::model
