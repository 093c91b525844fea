// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <numbers>

namespace bevel::model {
namespace {

// A motor stalls for an instant: from at_s on the axis stands elsewhere than its counter says. at_s = 0: not in this
// recording. The jump takes a moment, so that a fit can move its instant: an insertion's shows at once and takes no
// longer than the drives' messages are apart, a rotation's shows only in where the needle goes from there on. A rotor
// falls in again a whole electrical cycle on: four steps, 0.126 rad of a motor of 200 that turns the needle directly.
// A turn more leaves the bevel where it is: readings know the rotation modulo 2 pi.
class LostSteps final : public Effect {
 public:
  LostSteps()
      : Effect(
            {.name = "lost_steps",
             .meaning = "a motor lost steps that its counter did not see",
             .covariate = Covariate::time_s,
             .parameters = {
                 {.name = "rotation_rad",
                  .lower = -7,
                  .upper = 7,
                  .none = 0,
                  .starts = {-1.6, -0.8, 0.8, 1.6},
                  .reported = 1.5,
                  .modulo = 2 * std::numbers::pi,
                  .smallest_seen = 0.12},
                 {.name = "insertion_mm", .lower = -30, .upper = 30, .none = 0, .starts = {-3.0, 3.0}, .reported = 3},
                 {.name = "at_s",
                  .lower = 0,
                  .upper = 10000.0,
                  .none = 0,
                  .starts = {0.0},
                  .scope = Scope::recording,
                  .begins = Begins::instant}}}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual& insertion_mm,
            Dual& rotation_rad) const override {
    if (p[2].value <= 0) return;
    const auto share = [&](double stall_s) { return clamp((leg.to.time_s - p[2]) / stall_s + 0.5, 0, 1); };
    insertion_mm += share(kInsertionStall_s) * p[1];
    rotation_rad += share(kRotationStall_s) * p[0];
  }
  // One axis stalls, not both.
  std::span<const std::uint32_t> variants() const override {
    static constexpr std::uint32_t kOneAxis[] = {kOfRotation, kOfInsertion};
    return kOneAxis;
  }
  bool jumps(std::uint32_t kind) const override { return kind == kOfInsertion; }

 private:
  static constexpr std::uint32_t kOfRotation = 0b101, kOfInsertion = 0b110;
  static constexpr double kInsertionStall_s = 0.02;
  static constexpr double kRotationStall_s = 0.1;
};

}  // namespace

const Effect& lost_steps() {
  static const LostSteps effect;
  return effect;
}

}  // namespace bevel::model
