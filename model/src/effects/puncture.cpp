// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <cmath>

namespace bevel::model {
namespace {

// A membrane at z = depth: the tip stalls there while the base goes on by the indentation, then breaks through and
// catches up: within kCatchUp_mm of the base, or within the indentation where that is shorter, half of it before the
// indentation is reached and half after (less before where the indentation is not much longer). How it catches up
// nobody knows: meanwhile it is through with the probability of the share of the way that is done, or still held.
// Memory: how far the tip's axis was before it touched; then, how far the base was when it did, and along the axes of
// {A} the standard deviation of where it is.
class Puncture final : public Effect {
 public:
  Puncture()
      : Effect({.name = "puncture",
                .meaning = "a membrane holds the tip back until it breaks through",
                .covariate = Covariate::depth_mm,
                .parameters = {{.name = "depth_mm",
                                .lower = 0,
                                .upper = 300,
                                .none = kNoNone,
                                .starts = starts_every(0.25, 0.25, 120),
                                .likely_low = 0,
                                .likely_high = kLongestNeedle_mm,
                                .begins = Begins::depth},
                               {.name = "indentation_mm",
                                .lower = 0,
                                .upper = 15,
                                .none = 0,
                                .starts = {0.4, 1.2, 3.5},
                                .reported = 5,
                                .form_sd = kBreaks_sd_mm}},
                .sudden = true}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& /*rotation_rad*/) const override {
    enum Phase { kUnseen, kFree, kTouching, kThrough };
    if (memory.phase == kUnseen) {
      memory.phase = kFree;
      memory.slot[0] = leg.entry.insertion_mm;
    }
    Dual& touched_mm = memory.slot[0];
    if (memory.phase == kFree) {
      const Dual reach_mm = leg.tip_depth_mm + (insertion_mm - memory.slot[0]) * leg.heading_z;
      if (reach_mm.value > p[0].value && leg.tip_depth_mm.value <= p[0].value) {
        touched_mm = memory.slot[0] + (p[0] - leg.tip_depth_mm) / leg.heading_z;
        memory.phase = kTouching;
      } else {
        memory.slot[0] = insertion_mm;
      }
    }
    if (memory.phase == kTouching && p[1].value <= 0) memory.phase = kThrough;  // no membrane
    for (std::size_t i = 0; i < 3; ++i) memory.slot[kOpen + i] = {};
    if (memory.phase != kTouching) return;
    const Dual pushed_mm = insertion_mm - touched_mm;
    const Dual catch_up_mm = p[1].value < kCatchUp_mm ? p[1] : Dual(kCatchUp_mm);
    const Dual breaks_at_mm = p[1] * p[1] / (p[1] + 0.5 * catch_up_mm);
    if (pushed_mm.value > breaks_at_mm.value + catch_up_mm.value) {
      memory.phase = kThrough;
    } else if (pushed_mm.value > breaks_at_mm.value) {
      const double through = (pushed_mm.value - breaks_at_mm.value) / catch_up_mm.value;
      const double sd_mm = std::sqrt(through * (1 - through)) * (breaks_at_mm.value + catch_up_mm.value);
      for (std::size_t i = 0; i < 3; ++i) memory.slot[kOpen + i] = leg.R(static_cast<int>(i), 2) * sd_mm;
      insertion_mm = touched_mm + (pushed_mm - breaks_at_mm) * (breaks_at_mm + catch_up_mm) / catch_up_mm;
    } else if (pushed_mm.value > 0) {
      insertion_mm = touched_mm;
    } else {
      memory.phase = kFree;
      memory.slot[0] = insertion_mm;
    }
  }
  void blur(const EffectMemory& memory, std::array<double, 3>& variance_mm2) const override {
    for (std::size_t i = 0; i < 3; ++i) variance_mm2[i] += std::pow(memory.slot[kOpen + i].value, 2);
  }

 private:
  static constexpr std::size_t kOpen = 1;  // first of three slots
  static constexpr double kCatchUp_mm = 0.4;
  // Where on the way to it a membrane breaks is not known: values of 17 of them in blind trials were off by as much
  // beyond their standard errors.
  static constexpr double kBreaks_sd_mm = 0.07;
};

}  // namespace

const Effect& puncture() {
  static const Puncture effect;
  return effect;
}

}  // namespace bevel::model
