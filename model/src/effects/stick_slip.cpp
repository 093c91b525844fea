// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <cmath>

namespace bevel::model {
namespace {

// Friction holds the tip while the base stores up a jump's length, then lets go and the tip catches up, again and
// again: s = jump floor(d / jump) on the way in. A base that turns back has to store up as much the other way. A jump
// takes a little way of the base, about the place where it is due, so that a fit can move it: two milliseconds at 10
// mm/s. More would be worse than none: a base that stops within a jump leaves the tip half way. Memory: where it is
// held.
class StickSlip final : public Effect {
 public:
  StickSlip()
      : Effect({.name = "stick_slip",
                .meaning = "the tip sticks while the base advances, then slips after it, again and again",
                .covariate = Covariate::depth_mm,
                .parameters = {{.name = "jump_mm",
                                .lower = 0,
                                .upper = 10,
                                .none = 0,
                                .starts = starts(),
                                .reported = 3,
                                .shape = true,
                                .form_share = kOfScrew}},
                .sudden = true}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& /*rotation_rad*/) const override {
    Dual& held_mm = memory.slot[0];
    if (memory.phase == 0) held_mm = leg.entry.insertion_mm;
    memory.phase = 1;
    if (p[0].value <= kShortest_mm) return;
    const double side = insertion_mm.value < held_mm.value ? -1 : 1;
    const Dual catch_up_mm = 2 * kCatchUp_mm < p[0].value ? Dual(kCatchUp_mm) : 0.5 * p[0];
    const Dual stored_mm = (insertion_mm - held_mm) * side;
    const double jumps = std::max(0.0, std::floor((stored_mm.value - 0.5 * catch_up_mm.value) / p[0].value));
    held_mm += side * jumps * p[0];
    const Dual beyond_mm = stored_mm - (jumps + 1) * p[0];
    insertion_mm = held_mm + side * p[0] * clamp(beyond_mm / catch_up_mm + 0.5, 0, 1);
  }

 private:
  // Jumps are counted along the base, and a screw that is off by 0.01 mm in 100 mm is off in all recordings alike.
  static constexpr double kOfScrew = 1e-4;
  static constexpr double kShortest_mm = 1e-6;
  static constexpr double kCatchUp_mm = 0.02;
  // A fit finds a length only from one that gives about as many jumps on the way: in 90 mm, to a quarter of a jump.
  // From farther off, half the length does better than the next start. Lengths below 0.75 mm are tried to half a jump:
  // there are so many.
  static std::vector<double> starts() {
    constexpr double kWay_mm = 90;
    std::vector<double> all;
    for (int quarters = 4 * 300; quarters >= 4 * 23; quarters -= quarters > 4 * 120 ? 2 : 1)
      all.push_back(kWay_mm / (0.25 * quarters));
    return all;
  }
};

}  // namespace

const Effect& stick_slip() {
  static const StickSlip effect;
  return effect;
}

}  // namespace bevel::model
