// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The tip does not advance along its heading but at a constant angle to it, toward the bevel: f -> f + tan(angle) in
// the bevel's plane. The heading is what it was; the tip is carried aside by tan(angle) of what it advances.
class CuttingAngle final : public Effect {
 public:
  CuttingAngle()
      : Effect(
            {.name = "cutting_angle",
             .meaning = "the tip cuts at an angle to its heading, toward the bevel",
             .covariate = Covariate::depth_mm,
             .parameters = {
                 {.name = "angle_rad", .lower = -0.5, .upper = 0.5, .none = 0, .starts = {0.02}, .reported = 0.06}}}) {}

  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    const Dual aside_mm = sin(p[0]) / cos(p[0]) * leg.insertion_mm;
    const Dual2 side = leg.toward_bevel();
    const Dual3 world = leg.in_world({aside_mm * side[0], aside_mm * side[1]});
    for (std::size_t i = 0; i < 3; ++i) memory.slot[i] += world[i];
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    for (std::size_t i = 0; i < 3; ++i) position_mm[i] += memory.slot[i];
  }
};

}  // namespace

const Effect& cutting_angle() {
  static const CuttingAngle effect;
  return effect;
}

}  // namespace bevel::model
