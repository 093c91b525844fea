// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// Turning while inserting cuts a wider channel: k -> k / (1 + c w / v), w = |u2|, v = |u1|.
class Drilling final : public Effect {
 public:
  Drilling()
      : Effect({.name = "drilling",
                .meaning = "turning while inserting drills the channel wider and the needle bends less",
                .covariate = Covariate::turn_rate_rad_s,
                .parameters = {{.name = "coefficient_mm_per_rad",
                                .lower = 0,
                                .upper = 50,
                                .none = 0,
                                .starts = {1.0},
                                .reported = 3}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    if (leg.base_insertion_mm() == 0) return;
    const double turn_per_mm = std::abs(leg.base_rotation_rad() / leg.base_insertion_mm());
    const Dual factor = 1.0 / (1.0 + p[0] * turn_per_mm);
    for (Dual& k : kappa_per_mm) k = k * factor;
  }
};

}  // namespace

const Effect& drilling() {
  static const Drilling effect;
  return effect;
}

}  // namespace bevel::model
