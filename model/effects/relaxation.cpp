#include "model/effects/effect.hpp"

namespace bevel::model {
namespace {

// While cutting, the bevel's force holds the tip off to its side by an elastic offset, which builds over kBuild_mm and
// decays at rest with tau. The offset is kept in {A}: it does not turn with the shaft.
class Relaxation final : public Effect {
 public:
  Relaxation()
      : Effect({.name = "relaxation",
                .meaning = "the tissue pushes the tip aside while it cuts and lets go at rest",
                .covariate = Covariate::since_stop_s,
                .parameters = {
                    {.name = "amplitude_mm", .lower = 0, .upper = 10, .none = 0, .starts = {0.8}},
                    {.name = "tau_s", .lower = 0.1, .upper = 120, .none = kNoNone, .starts = {0.8, 2.5, 8.0}}}}) {}

  void settle(Parameters p, const LegView& leg, const Dual2& kappa_per_mm, EffectMemory& memory) const override {
    memory.phase = 1;
    if (leg.insertion_mm.value > kRest_mm_s * leg.duration_s()) {
      // The bevel's side: the heading turns toward kappa x e3, body -y for k > 0.
      const Dual& kx = kappa_per_mm[0];
      const Dual& ky = kappa_per_mm[1];
      if (kx.value == 0 && ky.value == 0) return;
      const Dual share = 1.0 / sqrt(kx * kx + ky * ky);
      const Dual2 side = leg.lateral_in_world({ky * share, -kx * share});
      const Dual built = 1.0 - exp(leg.insertion_mm * (-1 / kBuild_mm));
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] += (p[0] * side[i] - memory.slot[i]) * built;
    } else {
      const Dual left = exp(-leg.duration_s() / p[1]);
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] = memory.slot[i] * left;
    }
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    for (std::size_t i = 0; i < 2; ++i) position_mm[i] += memory.slot[i];
  }

 private:
  static constexpr double kBuild_mm = 5.0;    // "a few mm": 5 to 6 fits recorded decays best
  static constexpr double kRest_mm_s = 0.05;  // slower is rest
};

}  // namespace

const Effect& relaxation() {
  static const Relaxation effect;
  return effect;
}

}  // namespace bevel::model
