// SPDX-License-Identifier: MIT
#pragma once
// The discrepancy that nobody has a name for: a curve over one covariate, in one component of the tip's motion or of
// the reading, as an effect beside those of the registry. At the place c of its covariate it has the value
//   v(c) = sum_i w_i(c) values[i],  w linear between the knots, flat outside, round the circle if periodic.
// The components are those of component_effect.hpp.
#include <memory>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/effects/component_effect.hpp>

namespace bevel::model {

inline constexpr std::size_t kMaxKnots = 64;

struct DiscrepancyCurve {
  DiscrepancyComponent component = DiscrepancyComponent::curvature_bevel;
  Covariate covariate = Covariate::depth_mm;
  std::vector<double> at{};          // knots, ascending, in the covariate's unit; periodic: 2 pi i / n
  std::vector<double> values{};      // there, in the component's unit
  std::vector<double> std_errors{};  // of the values; what is not known of one knot says nothing about the next
  bool periodic = false;             // the covariate is an angle

  bool operator==(const DiscrepancyCurve&) const = default;
};

// First fault of a curve, as a clause that names the quantity, its value and what is allowed; empty if there is none.
std::string find_fault(const DiscrepancyCurve& curve);

// The two knots between which a place of the covariate lies, and their weights, which add up to one.
struct KnotWeights {
  std::array<std::size_t, 2> knot{};
  std::array<double, 2> weight{};
};
KnotWeights weights_at(std::span<const double> at, bool periodic, double place);

// The curve as an effect. Its parameters, none of them in model files, are added to the values of four of its knots,
// [first, first + 4): what a fit or a variance wants to know the derivatives by. Throws ArgumentError for a
// curve with a fault.
inline constexpr std::size_t kKnotsOfPart = kMaxEffectParameters;
std::shared_ptr<const Effect> make_discrepancy(DiscrepancyCurve curve, std::size_t first = 0);
// With its parameters at zero.
ActiveEffect active_discrepancy(const DiscrepancyCurve& curve);

}  // namespace bevel::model
