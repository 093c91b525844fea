// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// While cutting, the bevel's force holds the tip off to its side by an elastic offset, which builds over a few
// millimetres and decays at rest with tau. Over how many is the tissue's: fixed, it would bias both other parameters.
// The offset is kept in {A}: it does not turn with the shaft.
class Relaxation final : public Effect {
 public:
  Relaxation()
      : Effect({.name = "relaxation",
                .meaning = "the tissue pushes the tip aside while it cuts and lets go at rest",
                .covariate = Covariate::since_stop_s,
                .parameters = {
                    {.name = "amplitude_mm", .lower = 0, .upper = 10, .none = 0, .starts = {0.8}, .reported = 2},
                    {.name = "tau_s",
                     .lower = 0.1,
                     .upper = 120,
                     .none = kNoNone,
                     .starts = {0.8, 2.5, 8.0},
                     .likely_low = 0.8,
                     .likely_high = 20},
                    {.name = "build_mm",
                     .lower = 1,
                     .upper = 15,
                     .none = kNoNone,
                     .starts = {kUsualBuild_mm},
                     .likely_low = 1,
                     .likely_high = 10,
                     .usual = kUsualBuild_mm}}}) {}

  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    memory.phase = 1;
    if (leg.insertion_mm.value > kRest_mm_s * leg.duration_s()) {
      // The bevel's side, whichever way the path bends: after a turn the bevel pushes the new way at once, however
      // long the tissue holds the needle to its old curve.
      const Dual2 side = leg.lateral_in_world(leg.toward_bevel());
      const Dual built = 1.0 - exp(-leg.insertion_mm / p[2]);
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] += (p[0] * side[i] - memory.slot[i]) * built;
    } else if (leg.insertion_mm.value > -kRest_mm_s * leg.duration_s()) {
      const Dual left = exp(-leg.duration_s() / p[1]);
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] = memory.slot[i] * left;
    }
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    for (std::size_t i = 0; i < 2; ++i) position_mm[i] += memory.slot[i];
  }

 private:
  static constexpr double kUsualBuild_mm = 5.0;
  static constexpr double kRest_mm_s = 0.05;  // slower is rest
};

}  // namespace

const Effect& relaxation() {
  static const Relaxation effect;
  return effect;
}

}  // namespace bevel::model
