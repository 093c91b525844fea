// SPDX-License-Identifier: MIT
#include <bevel/model/needle.hpp>

#include <cmath>
#include <numbers>
#include <sstream>

namespace bevel::model {
namespace {
constexpr double kMaxCurvature_per_mm = 0.05;
constexpr double kMinWheelbase_mm = 1.0;
constexpr double kMaxWheelbase_mm = 1000.0;
}  // namespace

std::optional<DomainViolation> find_domain_violation(const NeedleParameters& needle, double gamma_max_rad) {
  const double k = needle.curvature_per_mm;
  const double ell = needle.wheelbase_mm;
  const double l1 = needle.lambda1_per_rad;
  const double l2 = needle.lambda2;
  if (!std::isfinite(k) || std::abs(k) >= kMaxCurvature_per_mm)
    return DomainViolation{DomainRule::curvature, k, kMaxCurvature_per_mm};
  if (!(ell > kMinWheelbase_mm && ell < kMaxWheelbase_mm))
    return DomainViolation{DomainRule::wheelbase, ell, ell > kMinWheelbase_mm ? kMaxWheelbase_mm : kMinWheelbase_mm};
  if (!std::isfinite(l1)) return DomainViolation{DomainRule::lambda_finite, l1, 0};
  if (!std::isfinite(l2)) return DomainViolation{DomainRule::lambda_finite, l2, 0};
  if (l1 == 0 && l2 == 0) return std::nullopt;  // the plain bicycle

  const double l1_bound = l2 * l2 / (2 * std::numbers::pi);
  if (!(l1 > l1_bound)) return DomainViolation{DomainRule::lambda1_bound, l1, l1_bound};

  // (24): 1 - lambda2 + 2 lambda1 |gamma| is smallest at gamma = 0, because lambda1 > 0 by (26).
  if (!(1 - l2 > 0)) return DomainViolation{DomainRule::gamma_monotonic, l2, 1};

  // (23): |alpha| = |lambda2 |gamma| - lambda1 gamma^2| has its extremes at gamma_max and at the stationary point.
  const auto slip_rad = [&](double gamma) { return std::abs(l2 * gamma - l1 * gamma * gamma); };
  const double stationary = l2 / (2 * l1);
  double largest = slip_rad(gamma_max_rad);
  if (stationary > 0 && stationary < gamma_max_rad) largest = std::max(largest, slip_rad(stationary));
  if (!(largest < std::numbers::pi / 2))
    return DomainViolation{DomainRule::slip_below_90, largest, std::numbers::pi / 2};
  return std::nullopt;
}

std::string describe(const DomainViolation& violation) {
  std::ostringstream text;
  switch (violation.rule) {
    case DomainRule::curvature:
      text << "curvature_per_mm is " << violation.value << "; it must be finite and below " << violation.limit
           << " /mm in size";
      break;
    case DomainRule::wheelbase:
      text << "wheelbase_mm is " << violation.value << "; it must lie between " << kMinWheelbase_mm << " and "
           << kMaxWheelbase_mm << " mm";
      break;
    case DomainRule::lambda_finite:
      text << "lambda is " << violation.value << "; lambda1_per_rad and lambda2 must be finite";
      break;
    case DomainRule::slip_below_90:
      text << "the slip angle reaches " << violation.value << " rad; it must stay below " << violation.limit
           << " rad, (23)";
      break;
    case DomainRule::gamma_monotonic:
      text << "lambda2 is " << violation.value << "; it must be below " << violation.limit
           << " so that 1 - d alpha/d gamma > 0, (24)";
      break;
    case DomainRule::lambda1_bound:
      text << "lambda1_per_rad is " << violation.value << "; it must be above lambda2^2/(2 pi) = " << violation.limit
           << ", (26), or both lambdas zero";
      break;
    case DomainRule::tilt_range:
      text << "the tilt is " << violation.value << " rad; its direction of motion must stay below " << violation.limit
           << " rad, the range of (25)";
      break;
  }
  return text.str();
}

}  // namespace bevel::model
