// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// A gap in the drive of the shaft: r = play(R, width).
class RotationBacklash final : public Effect {
 public:
  RotationBacklash()
      : Effect({.name = "rotation_backlash",
                .meaning = "the drive of the rotation has backlash",
                .covariate = Covariate::since_reversal_mm,
                .parameters = {
                    {.name = "width_rad", .lower = 0, .upper = 2, .none = 0, .starts = {0.3}, .reported = 0.6}}}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& /*insertion_mm*/,
            Dual& rotation_rad) const override {
    Dual& tip = memory.slot[0];
    if (memory.phase == 0) tip = leg.entry.rotation_rad;  // it starts in the middle of the gap
    memory.phase = 1;
    play(rotation_rad, p[0] * 0.5, tip);
    rotation_rad = tip;
  }
};

}  // namespace

const Effect& rotation_backlash() {
  static const RotationBacklash effect;
  return effect;
}

}  // namespace bevel::model
