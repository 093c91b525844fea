// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// Friction on the inserted shaft winds it up: a play whose one-way lag grows with the square of the inserted length,
// lag (L/100 mm)^2. Source: Reed, Okamura and Cowan 2009, "Modeling and control of needles with torsional friction",
// IEEE Trans. Biomed. Eng. 56(12).
class TorsionalWindup final : public Effect {
 public:
  TorsionalWindup()
      : Effect(
            {.name = "torsional_windup",
             .meaning = "friction on the inserted shaft winds it up, so the tip turns late",
             .covariate = Covariate::depth_mm,
             .parameters = {
                 {.name = "lag_at_100mm_rad", .lower = 0, .upper = 4, .none = 0, .starts = {0.4}, .reported = 0.9}}}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& rotation_rad) const override {
    Dual& tip = memory.slot[0];
    if (memory.phase == 0) tip = leg.entry.rotation_rad;
    memory.phase = 1;
    const Dual length = clamp((insertion_mm - leg.entry.insertion_mm) * 0.01, 0, 100);
    play(rotation_rad, p[0] * length * length, tip);
    rotation_rad = tip;
  }
};

}  // namespace

const Effect& torsional_windup() {
  static const TorsionalWindup effect;
  return effect;
}

}  // namespace bevel::model
