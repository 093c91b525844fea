// SPDX-License-Identifier: MIT
#pragma once
// The needle's parameters, and the set in which the extended bicycle model is defined.
// Source: "Extended Bicycle Model for Needle Steering in Soft Tissue" (IROS 2015), Section III.A; equation numbers are
// the paper's.
#include <optional>
#include <string>

namespace bevel::model {

// Which component of the tip's tilt slips once the shaft has been turned; the paper leaves it open (its (18) is
// planar).
enum class SlipDirection {
  isotropic,    // f = tan(alpha) d along the tilt: tissue does not know the bevel
  bevel_plane,  // as printed in (18): only the component along body y
};

// Sign of f in (13). In print plus; a front wheel that does not slip gives minus.
enum class FrontWheel { published, nonslip };

struct NeedleParameters {
  double curvature_per_mm =
      0.0047;                    // k = tan(beta)/ell; k > 0 bends toward body -y. Inferred, not printed in the paper
  double wheelbase_mm = 20.0;    // ell; inferred, not printed in the paper
  double lambda1_per_rad = 0.0;  // (25)
  double lambda2 = 0.0;          // (25)
  SlipDirection slip = SlipDirection::isotropic;
  FrontWheel front_wheel = FrontWheel::published;

  bool operator==(const NeedleParameters&) const = default;
};

enum class DomainRule {
  curvature,        // |k| finite and below 0.05 /mm (a radius of 20 mm; steerable needles have 50 mm and more)
  wheelbase,        // ell in (1, 1000) mm
  lambda_finite,    // both finite
  slip_below_90,    // (23) cos(alpha) != 0 over the range of gamma in use
  gamma_monotonic,  // (24) 1 - d alpha/d gamma > 0 over the range of gamma in use
  lambda1_bound,    // (26) lambda1 > lambda2^2/(2 pi), or both zero
  tilt_range,       // theta has no gamma, or gamma is outside (-pi/2, pi/2), where (25) is defined
};

// Which rule is broken, by which value, and the limit that the value has to respect. Holds no memory: usable in a step.
struct DomainViolation {
  DomainRule rule;
  double value;
  double limit;
};

// The largest |gamma| of the paper's experiments is below pi/4; the default leaves room above it.
inline constexpr double kDefaultGammaMax_rad = 1.0;

// First rule that the parameters break for |gamma| <= gamma_max_rad, or nothing.
std::optional<DomainViolation> find_domain_violation(const NeedleParameters& needle,
                                                     double gamma_max_rad = kDefaultGammaMax_rad);

// One sentence: the quantity, its value, what is allowed and the equation that says so.
std::string describe(const DomainViolation& violation);

}  // namespace bevel::model
