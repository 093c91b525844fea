#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// A gap in the drive of the insertion: s = play(d, width); it starts in the middle of the gap.
class InsertionBacklash final : public Effect {
 public:
  InsertionBacklash()
      : Effect(
            {.name = "insertion_backlash",
             .meaning = "the drive of the insertion has backlash",
             .covariate = Covariate::since_reversal_mm,
             .parameters = {{.name = "width_mm", .lower = 0, .upper = 10, .none = 0, .starts = {1.0}, .reported = 2}},
             .needs_retraction = true}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& /*rotation_rad*/) const override {
    Dual& tip = memory.slot[0];
    if (memory.phase == 0) tip = leg.entry.insertion_mm;
    memory.phase = 1;
    play(insertion_mm, p[0] * 0.5, tip);
    insertion_mm = tip;
  }
};

}  // namespace

const Effect& insertion_backlash() {
  static const InsertionBacklash effect;
  return effect;
}

}  // namespace bevel::model
