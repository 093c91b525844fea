// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The tissue holds the needle to its old curve for a while: the curvature vector, in the roll frame of the tissue,
// follows the bevel over a length, dK/ds = (K_bevel - K) / length. K_bevel has the size that speed, depth and drilling
// leave to k: that is followed over the length too. Solved exactly over a leg for the bevel's mean direction. The
// memory is K / k with the needle's own k, so that it does not depend on k; it holds while the needle is drawn back.
class FlipTransient final : public Effect {
 public:
  FlipTransient()
      : Effect({.name = "flip_transient",
                .meaning = "after a turn the needle takes a length of tissue to bend the new way",
                .covariate = Covariate::since_reversal_mm,
                .parameters = {
                    {.name = "length_mm", .lower = 0, .upper = 60, .none = 0, .starts = {4, 10}, .reported = 14}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& memory, Dual2& kappa_per_mm) const override {
    const Dual& k = leg.curvature_per_mm;
    if (k.value == 0) return;  // nothing bends
    const Dual roll = leg.tip_rotation_rad + 0.5 * leg.rotation_rad;
    const Dual size = kappa_per_mm[0] / k;
    const Dual2 bevel = {size * cos(roll), size * sin(roll)};
    Dual2 K = {memory.slot[0], memory.slot[1]};
    if (memory.phase == 0) K = {cos(leg.tip_rotation_rad), sin(leg.tip_rotation_rad)};
    memory.phase = 1;
    Dual2 mean = bevel;
    if (p[0].value > kShortest_mm) {
      const Dual x = clamp(leg.insertion_mm / p[0], 0, 1e3);
      const Dual left = exp(-x);
      // (1 - e^-x) / x, by its series where the quotient loses digits.
      const Dual share = x.value > 1e-3 ? (1.0 - left) / x : 1.0 - 0.5 * x + x * x * (1.0 / 6);
      for (std::size_t i = 0; i < 2; ++i) {
        mean[i] = bevel[i] + (K[i] - bevel[i]) * share;
        K[i] = bevel[i] + (K[i] - bevel[i]) * left;
      }
    } else if (leg.insertion_mm.value > 0) {
      K = bevel;
    }
    memory.slot = {K[0], K[1], Dual()};
    // The needle's own curvature is along body x: the mean direction takes its place.
    const Dual2 in_body = turned(mean, -roll);
    kappa_per_mm = {k * in_body[0], kappa_per_mm[1] + k * in_body[1]};
  }

 private:
  static constexpr double kShortest_mm = 1e-6;
};

}  // namespace

const Effect& flip_transient() {
  static const FlipTransient effect;
  return effect;
}

}  // namespace bevel::model
