// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Converts the discrepancy of a needle (bevel/model/effects/discrepancy.hpp) to curves of the inference: each
/// component as a function of each covariate that varies in the recordings.
#include <memory>

#include <bevel/diagnosis/inference/system.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/open_loop.hpp>

namespace bevel::diagnosis {

/// Component of the motion or of the measurement that a discrepancy term changes.
using Component = model::DiscrepancyComponent;

/// A discrepancy term without its values.
struct NeedleCurve {
  Component component;         ///< component that it changes
  model::Covariate covariate;  ///< argument
  inference::Curve curve;      ///< knots, unit and names
};

/// Lists each pair of component and covariate that varies in the recordings.
/// @param motions actuator motion of each recording
/// @param seen_mm measured tip positions in {A}, mm; NaN: no position
/// @return one curve per pair
std::vector<NeedleCurve> find_curves(const std::vector<const model::Motion*>& motions,
                                     const std::vector<Eigen::Vector3d>& seen_mm);

/// Computes the weights of a curve's values for one covariate value: linear interpolation between the knots, constant
/// outside them, periodic for a periodic curve.
/// @param curve the curve
/// @param x the covariate, in its unit
/// @return one weight per knot
Eigen::VectorXd weights_at(const inference::Curve& curve, double x);

/// Converts a curve to the form of a model file.
/// @param curve the curve
/// @param values values at its knots, in the component's unit
/// @param std_errors standard errors of values
/// @return the discrepancy term
model::DiscrepancyCurve to_model(const NeedleCurve& curve, std::vector<double> values, std::vector<double> std_errors);

/// Converts a curve to an effect. The values are not limited: a fit can exceed the limits of a model file.
/// @param curve the curve
/// @param values values at its knots, in the component's unit
/// @param first_column column of the path's Jacobian for the first value, the others follow; -1: no derivatives
/// @return the effect
std::shared_ptr<const model::Effect> make_curve(const NeedleCurve& curve, const Eigen::VectorXd& values,
                                                int first_column = -1);

/// Number of a curve's values that are the parameters of one effect of make_curve_part().
inline constexpr std::size_t kValuesOfPart = model::kKnotsOfPart;
/// Converts kValuesOfPart values of a curve to an effect, whose parameters they are. The other values are zero.
/// @param curve the curve
/// @param first index of the first value
/// @return the effect
std::shared_ptr<const model::Effect> make_curve_part(const NeedleCurve& curve, std::size_t first);

}  // namespace bevel::diagnosis
