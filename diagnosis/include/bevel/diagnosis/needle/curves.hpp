// SPDX-License-Identifier: MIT
#pragma once
// The discrepancy of a needle (bevel/model/effects/discrepancy.hpp) as the engine's curves: every component over every
// covariate that varies in the recordings.
#include <memory>

#include <bevel/diagnosis/inference/system.hpp>
#include <bevel/model/effects/discrepancy.hpp>
#include <bevel/model/effects/open_loop.hpp>

namespace bevel::diagnosis {

using Component = model::DiscrepancyComponent;

struct NeedleCurve {
  Component component;
  model::Covariate covariate;
  inference::Curve curve;
};

// Every pair of component and covariate that varies in these recordings. seen_mm: where readings had the tip, in {A};
// not a number where they do not say.
std::vector<NeedleCurve> find_curves(const std::vector<const model::Motion*>& motions,
                                     const std::vector<Eigen::Vector3d>& seen_mm);

// Weights of a curve's values at a place of its covariate: linear between them, flat outside, round the circle.
Eigen::VectorXd weights_at(const inference::Curve& curve, double x);

// The curve with these values, as a model file carries it.
model::DiscrepancyCurve to_model(const NeedleCurve& curve, std::vector<double> values, std::vector<double> std_errors);

// The curve with these values as an effect, whatever they are: a fit may go beyond what a model file may hold.
// first_column: of the path's sensitivities, which that by the first value is; -1: by none of them.
std::shared_ptr<const model::Effect> make_curve(const NeedleCurve& curve, const Eigen::VectorXd& values,
                                                int first_column = -1);

// The value itself as an effect with slope in one dual number: part of the curves' values, [first, first + 4), the rest
// taken as zero.
inline constexpr std::size_t kValuesOfPart = model::kKnotsOfPart;
std::shared_ptr<const model::Effect> make_curve_part(const NeedleCurve& curve, std::size_t first);

}  // namespace bevel::diagnosis
