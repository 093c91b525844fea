// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Discrepancy term: unmodelled physics as a piecewise linear function of one covariate. It acts on one component of
/// the tip's motion or of the measurement, in addition to the effects of the registry. At the value c of its covariate
/// it is
///
///     v(c) = sum_i w_i(c) values[i]
///
/// The weights w are linear between the knots and constant outside them. On a periodic covariate they wrap around.
/// component_effect.hpp defines the components.
#include <memory>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/effects/component_effect.hpp>

namespace bevel::model {

/// Largest number of knots.
inline constexpr std::size_t kMaxKnots = 64;

/// Discrepancy term in one component over one covariate.
struct DiscrepancyCurve {
  DiscrepancyComponent component = DiscrepancyComponent::curvature_bevel;  ///< component that the term changes
  Covariate covariate = Covariate::depth_mm;                               ///< argument of the term
  std::vector<double> at{};      ///< knots, ascending, in the covariate's unit; 2 pi i/n if periodic; 1 to kMaxKnots
  std::vector<double> values{};  ///< value at each knot, in the component's unit
  std::vector<double>
      std_errors{};       ///< standard error of each value, in the same unit; errors of knots are independent
  bool periodic = false;  ///< true if the covariate is an angle; allowed for Covariate::roll_rad only

  /// @return true if all members are equal
  bool operator==(const DiscrepancyCurve&) const = default;
};

/// Checks a curve: number and order of knots, sizes of the vectors, ranges of the values.
/// @param curve curve to check
/// @return the first fault as a clause with the quantity, its value and the allowed range; empty if the curve is valid
std::string find_fault(const DiscrepancyCurve& curve);

/// The two knots around a value of the covariate, with interpolation weights.
struct KnotWeights {
  std::array<std::size_t, 2> knot{};  ///< indices of the knots; equal outside the knots
  std::array<double, 2> weight{};     ///< weights of the knots; their sum is 1
};
/// Computes the knots and weights of the linear interpolation.
/// @param at knots, ascending, at least one, in the covariate's unit
/// @param periodic true if the knots divide the circle evenly
/// @param place value of the covariate, in its unit
/// @return knots and weights
KnotWeights weights_at(std::span<const double> at, bool periodic, double place);

/// Number of knots whose values are parameters of one effect.
inline constexpr std::size_t kKnotsOfPart = kMaxEffectParameters;
/// Creates an effect from a curve. Its parameters are added to the values of the knots [first, first + kKnotsOfPart),
/// so that a fit or a variance obtains the derivatives. Model files do not contain these parameters.
/// @param curve curve
/// @param first index of the first knot with a parameter
/// @return the effect
/// @throws bevel::ArgumentError if find_fault() finds a fault
std::shared_ptr<const Effect> make_discrepancy(DiscrepancyCurve curve, std::size_t first = 0);
/// Creates an active effect from a curve, with all parameters at zero.
/// @param curve curve
/// @return the effect, owned by the result
/// @throws bevel::ArgumentError if find_fault() finds a fault
ActiveEffect active_discrepancy(const DiscrepancyCurve& curve);

}  // namespace bevel::model
