// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// Another tissue from a depth on: k -> ratio k beyond z = depth. A leg that crosses the boundary gets its share.
class Layer final : public Effect {
 public:
  Layer()
      : Effect(
            {.name = "layer",
             .meaning = "a second layer of tissue bends the needle differently",
             .covariate = Covariate::depth_mm,
             .parameters = {
                 {.name = "depth_mm",
                  .lower = 0,
                  .upper = 300,
                  .none = kNoNone,
                  .starts = starts_every(7.5, 7.5, 120),
                  .likely_low = 0,
                  .likely_high = kLongestNeedle_mm,
                  .begins = Begins::depth},
                 {.name = "curvature_ratio", .lower = 0, .upper = 4, .none = 1, .starts = {0.8}, .reported = 0.8}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    const Dual end_mm = leg.tip_depth_mm + leg.insertion_mm * leg.heading_z;
    const Dual before_mm = leg.tip_depth_mm - p[0];
    const Dual after_mm = end_mm - p[0];
    Dual share;
    if (before_mm.value >= 0 && after_mm.value >= 0) {
      share = 1;
    } else if (before_mm.value < 0 && after_mm.value < 0) {
      share = 0;
    } else if (after_mm.value >= 0) {
      share = after_mm / (after_mm - before_mm);
    } else {
      share = before_mm / (before_mm - after_mm);
    }
    const Dual factor = 1.0 + (p[1] - 1.0) * share;
    for (Dual& k : kappa_per_mm) k = k * factor;
  }
};

}  // namespace

const Effect& layer() {
  static const Layer effect;
  return effect;
}

}  // namespace bevel::model
