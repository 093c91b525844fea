// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// A curvature fixed in the world (gravity, a gradient in the tissue): the heading turns toward +x_A by x_per_mm and
// toward +y_A by y_per_mm.
class LateralBias final : public Effect {
 public:
  LateralBias()
      : Effect({.name = "lateral_bias",
                .meaning = "a constant sideways pull, fixed in space, bends the needle",
                .covariate = Covariate::roll_rad,
                .parameters = {
                    {.name = "x_per_mm", .lower = -0.02, .upper = 0.02, .none = 0, .starts = {1e-4}, .reported = 0.002},
                    {.name = "y_per_mm",
                     .lower = -0.02,
                     .upper = 0.02,
                     .none = 0,
                     .starts = {1e-4},
                     .reported = 0.002}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    const Dual2 pull = leg.curvature_toward({p[0], p[1]});
    for (std::size_t i = 0; i < 2; ++i) kappa_per_mm[i] += pull[i];
  }
};

}  // namespace

const Effect& lateral_bias() {
  static const LateralBias effect;
  return effect;
}

}  // namespace bevel::model
