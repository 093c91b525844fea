// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The longer the shaft in the tissue the stiffer it stands: k -> k (1 + c z / 100 mm), z halfway through the leg.
class DepthDependence final : public Effect {
 public:
  DepthDependence()
      : Effect({.name = "depth_dependence",
                .meaning = "the curvature changes steadily with depth",
                .covariate = Covariate::depth_mm,
                .parameters = {
                    {.name = "per_100mm", .lower = -2, .upper = 4, .none = 0, .starts = {0.3}, .reported = 0.8}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    const Dual z_mm = leg.tip_depth_mm + 0.5 * leg.insertion_mm * leg.heading_z;
    const Dual factor = 1.0 + p[0] * z_mm * 0.01;
    for (Dual& k : kappa_per_mm) k = k * factor;
  }
};

}  // namespace

const Effect& depth_dependence() {
  static const DepthDependence effect;
  return effect;
}

}  // namespace bevel::model
