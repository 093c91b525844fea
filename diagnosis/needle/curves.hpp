#pragma once
// Components of the discrepancy of a needle, each as a function of one covariate: the curvature toward the bevel and
// across it, the advance and the turning of the tip per mm and per rad of the base, a sideways drift, and the reading
// along each axis of {A}.
#include <memory>

#include "diagnosis/inference/system.hpp"
#include "model/effects/effect.hpp"
#include "model/effects/open_loop.hpp"

namespace bevel::diagnosis {

enum class Component {
  curvature_bevel,
  curvature_across,
  advance,
  turning,
  advance_turning,
  turning_turning,
  drift_bevel,
  drift_across,
  x,
  y,
  z
};

struct NeedleCurve {
  Component component;
  model::Covariate covariate;
  inference::Curve curve;
};

// Every pair of component and covariate that varies in these motions.
std::vector<NeedleCurve> find_curves(const std::vector<const model::Motion*>& motions);

// Weights of a curve's values at a place of its covariate: linear between them, flat outside, round the circle.
Eigen::VectorXd weights_at(const inference::Curve& curve, double x);

// The value itself as an effect with slope in one dual number: part of the curves' values, [first, first + 4), the rest
// taken as zero.
inline constexpr std::size_t kValuesOfPart = model::kMaxEffectParameters;
std::unique_ptr<model::Effect> make_curve_part(const NeedleCurve& curve, std::size_t first);

}  // namespace bevel::diagnosis
