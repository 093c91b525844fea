// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Needle parameters of the extended bicycle model, and the domain in which the model is defined.
/// Source: "Extended Bicycle Model for Needle Steering in Soft Tissue" (IROS 2015), Section III.A. Equation numbers in
/// this module are those of the paper.
#include <optional>
#include <string>

namespace bevel::model {

/// Selects the component of the tip's tilt that slips while the shaft rotates. Eq. (18) of the paper is planar and does
/// not define this case.
enum class SlipDirection {
  isotropic,    ///< f = tan(alpha) d along the tilt direction d: the tissue response does not depend on the bevel
  bevel_plane,  ///< as printed in (18): only the component along body y slips
};

/// Selects the sign of f in (13).
enum class FrontWheel {
  published,  ///< plus, as printed
  nonslip     ///< minus, which follows from a front wheel that does not slip
};

/// Parameters of one needle in one tissue. The default is a bicycle without slip.
struct NeedleParameters {
  /// Curvature k = tan(beta)/ell, 1/mm; k > 0 bends toward body -y. The default is inferred; the paper does not print
  /// it.
  double curvature_per_mm = 0.0047;
  double wheelbase_mm = 20.0;                      ///< ell, mm. The default is inferred; the paper does not print it.
  double lambda1_per_rad = 0.0;                    ///< quadratic coefficient of the slip law (25), 1/rad
  double lambda2 = 0.0;                            ///< linear coefficient of the slip law (25), dimensionless
  SlipDirection slip = SlipDirection::isotropic;   ///< direction of the slip when the shaft rotates
  FrontWheel front_wheel = FrontWheel::published;  ///< sign of f in (13)

  /// @return true if all parameters are equal
  bool operator==(const NeedleParameters&) const = default;
};

/// Conditions under which the model is defined.
enum class DomainRule {
  curvature,        ///< |k| is finite and below 0.05 /mm (20 mm radius; steerable needles have 50 mm and more)
  wheelbase,        ///< ell is in (1, 1000) mm
  lambda_finite,    ///< lambda1 and lambda2 are finite
  slip_below_90,    ///< (23): cos(alpha) != 0 over the range of gamma in use
  gamma_monotonic,  ///< (24): 1 - d alpha/d gamma > 0 over the range of gamma in use
  lambda1_bound,    ///< (26): lambda1 > lambda2^2/(2 pi), or both are zero
  tilt_range,       ///< gamma exists for the tilt theta and is in (-pi/2, pi/2), where (25) is defined
};

/// Violation of one rule. The type allocates no memory, so control steps can return it.
struct DomainViolation {
  DomainRule rule;  ///< rule that is violated
  double value;     ///< value found, in the unit of the quantity
  double limit;     ///< limit of that quantity, in the same unit
};

/// Default limit of |gamma|, rad. In every experiment of the paper |gamma| is below pi/4; the default adds a margin.
inline constexpr double kDefaultGammaMax_rad = 1.0;

/// Checks the needle parameters against all rules except DomainRule::tilt_range.
/// @param needle parameters to check
/// @param gamma_max_rad largest |gamma| in use, rad; (23) and (24) are checked up to it
/// @return the first violation in the order curvature, wheelbase, lambda_finite, lambda1_bound, gamma_monotonic,
///     slip_below_90; empty if the parameters are valid
std::optional<DomainViolation> find_domain_violation(const NeedleParameters& needle,
                                                     double gamma_max_rad = kDefaultGammaMax_rad);

/// Formats a violation as one sentence with the quantity, its value, the allowed range and the equation.
/// @param violation violation to format
/// @return the sentence, without a full stop
std::string describe(const DomainViolation& violation);

}  // namespace bevel::model
