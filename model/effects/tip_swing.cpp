#include "model/effects/effect.hpp"

namespace bevel::model {
namespace {

// A stiff shaft in soft tissue bends under the bevel's force, and the tip stands off the shaft's line toward the bevel.
// Turning the base turns that force: the tip swings on a circle of radius 2 F lambda / k. In two kinds:
//
// radius_mm, relax_mm: the tissue lets the tip back to the line as it cuts on; the offset o is that of the turns alone,
//   do = radius du - o ds / relax, with u the unit vector toward the bevel.
//
// bending_mm, guide_mm: 1 / lambda = (4 EI / k)^(1/4), the length over which the shaft bends: a beam on an elastic
//   foundation, to whose end the bevel's force belongs, clamped in its guide (Hetenyi, "Beams on Elastic Foundation",
//   1946, section 7: an end yields to a force by g, and turns by h, of what it does deep in the tissue). The tip cuts
//   where it is, so that a step ds moves the force on, which is a moment F ds. With K the needle's curvature F / (EI
//   lambda), L the depth of the tip, x = (L + guide) / bending, slope = K bending / 2 and radius = K bending^2 / 2:
//     bicycle:  d theta = K g h u ds
//     tip:      dp = (theta + 2 slope h u) ds + radius g du
//     depth:    less by 3/2 (slope h)^2 ds: what is fed is the length of a bent shaft
//     heading:  theta + slope h u
//     g = (sinh x cosh x - sin x cos x) / (cosh^2 x + cos^2 x),  h = (sinh^2 x + sin^2 x) / (cosh^2 x + cos^2 x).
//   That is the beam for small slopes; between guide and tissue the shaft bends as if it were held there too, which is
//   the same to the fifth power of guide / bending. The force is taken to act on the way back too, which it does for no
//   more than the bevel's length. The other two parameters have no part. Beams of finite slopes, in tissue of which a
//   part relaxes, come out as other values of the two: by what 18 of them did, beyond the noise, each has its form_sd.
// Memory: the offset, and the heading's own tilt toward the bevel.
class TipSwing final : public Effect {
 public:
  TipSwing()
      : Effect(
            {.name = "tip_swing",
             .meaning = "the shaft is stiff in soft tissue: its tip stands off toward the bevel and swings as it turns",
             .covariate = Covariate::roll_rad,
             .parameters = {
                 {.name = "radius_mm", .lower = 0, .upper = 20, .none = 0, .starts = {0.5}, .reported = 1.5},
                 {.name = "relax_mm", .lower = 0.5, .upper = 1000, .none = kNoNone, .starts = {2, 6, 18}, .usual = 5},
                 {.name = "bending_mm",
                  .lower = 0,
                  .upper = 200,
                  .none = 0,
                  .starts = {15, 40, 80},
                  .reported = 60,
                  .shape = true,
                  .form_sd = 1.8},
                 {.name = "guide_mm",
                  .lower = 0,
                  .upper = 50,
                  .none = kNoNone,
                  .starts = {0, 15},
                  .usual = 0,
                  .form_sd = 1.3}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    if (p[2].value <= kShortest_mm) return;
    const End end = end_at((depth_halfway(leg) + p[3]) / p[2]);
    for (Dual& k : kappa_per_mm) k = k * end.g * end.h;
  }
  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    const double side = leg.curvature_per_mm.value < 0 ? -1 : 1;
    Dual of_turn_mm = p[0], kept = 1;  // what a turn within the leg leaves at its end; what is left of all before
    Dual2 body;                        // what the offset grows by, in {B} at the start of the leg
    if (p[2].value > kShortest_mm) {
      const End end = end_at((depth_halfway(leg) + p[3]) / p[2]);
      const Dual slope = 0.5 * side * leg.curvature_per_mm * p[2];
      const Dual2 toward = leg.toward_bevel();
      for (std::size_t i = 0; i < 2; ++i) body[i] = 2.0 * slope * end.h * leg.insertion_mm * toward[i];
      memory.slot[2] -= 1.5 * slope * slope * end.h * end.h * leg.insertion_mm;
      // The first touch bends what lies free before the tissue; until then there is no force to turn.
      if (memory.phase == 0 && leg.insertion_mm.value > 0) {
        memory.phase = 1;
        body[1] -= side * slope * p[2] * end_at(p[3] / p[2]).g;
      }
      of_turn_mm = memory.phase == 0 ? Dual(0) : slope * p[2] * end.g;
      memory.slot[kTilt] = side * slope * end.h;
    } else if (leg.insertion_mm.value > 0) {
      const Dual x = leg.insertion_mm / p[1];
      kept = exp(-x);
      of_turn_mm = p[0] * (x.value > 1e-3 ? (1.0 - kept) / x : 1.0 - 0.5 * x);
    }
    // By which the direction toward the bevel turned: from (0, -1).
    const Dual2 turned_by = {sin(leg.rotation_rad), 1.0 - cos(leg.rotation_rad)};
    for (std::size_t i = 0; i < 2; ++i) body[i] += side * of_turn_mm * turned_by[i];
    const Dual3 world = leg.in_world(body);
    for (std::size_t i = 0; i < 3; ++i) memory.slot[i] = memory.slot[i] * kept + world[i];
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    for (std::size_t i = 0; i < 3; ++i) position_mm[i] += memory.slot[i];
  }
  void sensor(Parameters /*p*/, const EffectMemory& memory, Dual2& tilt_rad) const override {
    tilt_rad[0] += memory.slot[kTilt];
  }
  std::span<const std::uint32_t> variants() const override {
    static constexpr std::uint32_t kKinds[] = {0b0011, 0b1100};
    return kKinds;
  }

 private:
  static constexpr double kShortest_mm = 1e-6;
  static constexpr double kDeep = 15;  // bending lengths, from where on nothing changes
  static constexpr std::size_t kTilt = 3;

  static Dual depth_halfway(const LegView& leg) { return leg.tip_depth_mm + 0.5 * leg.insertion_mm * leg.heading_z; }
  struct End {
    Dual g, h;
  };
  static End end_at(const Dual& bending_lengths) {
    const Dual x = clamp(bending_lengths, 0, kDeep);
    // Over 4 exp(-2x), so that nothing overflows.
    const Dual E = exp(-2.0 * x), c = cos(x), s = sin(x);
    const Dual one = 1.0 / (1.0 + 2.0 * E + E * E + 4.0 * E * c * c);
    return {(1.0 - E * E - 4.0 * E * s * c) * one, (1.0 - 2.0 * E + E * E + 4.0 * E * s * s) * one};
  }
};

}  // namespace

const Effect& tip_swing() {
  static const TipSwing effect;
  return effect;
}

}  // namespace bevel::model
