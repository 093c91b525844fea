// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <bevel/model/effects/effect.hpp>

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
//   the same to the fifth power of guide / bending. Of the bevel's face only what meets uncut tissue pushes: the force
//   comes up over its length at the entry, and goes as the tip is drawn back by as much. There the tip is off its path
//   by radius g (u force - u cut), of what pushes now and of what has cut there: springs and shaft are those of then.
//   Drawn back, the tip lies in the channel it has cut: turning there turns the force to come and not the path, until
//   the tip is at the channel's end again. (How it was turned on the way in is not remembered: exact where the part
//   that is drawn back was cut without turning.) The other two parameters have no part. In tissue of which a part
//   relaxes, beams come out as other values of the two: by what 18 of them did, beyond the noise, each has its form_sd.
// Memory: the offset, and the heading's own tilt toward the bevel; where the tip is in its channel.
class TipSwing final : public Effect {
 public:
  TipSwing()
      : Effect(
            {.name = "tip_swing",
             .meaning = "the shaft is stiff in soft tissue: its tip stands off toward the bevel and swings as it turns",
             .covariate = Covariate::roll_rad,
             .parameters = {{.name = "radius_mm", .lower = 0, .upper = 20, .none = 0, .starts = {0.5}, .reported = 1.5},
                            {.name = "relax_mm",
                             .lower = 0.5,
                             .upper = 1000,
                             .none = kNoNone,
                             .starts = {2, 6, 18},
                             .likely_low = 2,
                             .likely_high = 18,
                             .usual = 5},
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
                             .likely_low = 0,
                             .likely_high = 15,
                             .usual = 0,
                             .form_sd = 1.3}}}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& rotation_rad) const override {
    if (p[2].value <= kShortest_mm) return;
    auto& [front_mm, behind_mm, due_rad, force, force_before, due_before_rad] = memory.number;
    const double depth_mm = leg.tip_depth_mm.value;
    if (memory.phase == 0) {  // from the entry on, or from where it is looked at first: there it cuts
      memory.phase = 1;
      front_mm = leg.from.insertion_mm;
      force = std::clamp(depth_mm / kBevel_mm, 0.0, 1.0);
    }
    const double by_mm = insertion_mm.value - (front_mm - behind_mm);
    front_mm = std::max(front_mm, insertion_mm.value);
    behind_mm = front_mm - insertion_mm.value;
    force_before = force, due_before_rad = due_rad;
    const double in_mm = std::min(depth_mm + by_mm * leg.heading_z.value, kBevel_mm);
    force = std::clamp((in_mm - behind_mm) / kBevel_mm, 0.0, 1.0);
    due_rad = 0;
    if (behind_mm > kAtFront_mm) {
      due_rad = rotation_rad.value - leg.tip_rotation_rad.value;
      rotation_rad = leg.tip_rotation_rad;
    }
  }
  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    if (p[2].value <= kShortest_mm) return;
    const End end = end_at(bending_lengths(p, leg, 0.5));
    for (Dual& k : kappa_per_mm) k = k * end.g * end.h * cut_by(leg, 0.5);
  }
  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    const double side = leg.curvature_per_mm.value < 0 ? -1 : 1;
    Dual kept = 1;  // what is left of all before
    Dual2 body;     // what the offset grows by, in {B} at the start of the leg
    if (p[2].value > kShortest_mm) {
      const End end = end_at(bending_lengths(p, leg, 0.5));
      const Dual slope = 0.5 * side * leg.curvature_per_mm * p[2], radius_mm = side * slope * p[2];
      const Dual2 toward = leg.toward_bevel();
      const double cut_before = cut_by(leg, 0), cut = cut_by(leg, 1), by = cut_by(leg, 0.5);
      for (std::size_t i = 0; i < 2; ++i) body[i] = 2.0 * by * slope * end.h * leg.insertion_mm * toward[i];
      memory.slot[2] -= 1.5 * by * by * slope * slope * end.h * end.h * leg.insertion_mm;
      // The path is cut where the tip is: it has the turns, at rest too, and the force that comes up. From (0, -1).
      const Dual cut_sin = cut * sin(leg.rotation_rad), cut_cos = cut * cos(leg.rotation_rad);
      body[0] += radius_mm * end.g * cut_sin;
      body[1] -= radius_mm * end.g * (cut_cos - cut_before);
      // Behind its end the tip is off the path by what the force lacks of that which has cut there.
      const auto& [front_mm, behind_mm, due_rad, force, force_before, due_before_rad] = memory.number;
      const auto off_path = [&](double sign, double share, double pushes, const Dual& turned, const Dual& cuts_sin,
                                const Dual& cuts_cos) {
        const Dual g = sign * radius_mm * end_at(bending_lengths(p, leg, share)).g;
        body[0] += g * (pushes * sin(turned) - cuts_sin);
        body[1] -= g * (pushes * cos(turned) - cuts_cos);
      };
      if (force_before < cut_before || due_before_rad != 0)
        off_path(-1, 0, force_before, due_before_rad, 0, cut_before);
      if (force < cut || due_rad != 0) off_path(1, 1, force, leg.rotation_rad + due_rad, cut_sin, cut_cos);
      memory.slot[kTilt] = side * slope * end.h * force;
    } else {
      Dual of_turn_mm = p[0];  // what a turn within the leg leaves at its end
      if (leg.insertion_mm.value > 0) {
        const Dual x = leg.insertion_mm / p[1];
        kept = exp(-x);
        of_turn_mm = p[0] * (x.value > 1e-3 ? (1.0 - kept) / x : 1.0 - 0.5 * x);
      }
      // By which the direction toward the bevel turned: from (0, -1).
      const Dual2 turned_by = {sin(leg.rotation_rad), 1.0 - cos(leg.rotation_rad)};
      for (std::size_t i = 0; i < 2; ++i) body[i] = side * of_turn_mm * turned_by[i];
    }
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
  static constexpr double kDeep = 15;         // bending lengths, from where on nothing changes
  static constexpr double kBevel_mm = 3.5;    // of an 18 gauge needle, along the shaft
  static constexpr double kAtFront_mm = 0.1;  // nearer to the channel's end than this a turn turns the path
  static constexpr std::size_t kTilt = 3;

  // From the guide to the tip; share: of the leg, from its start.
  static Dual bending_lengths(Parameters p, const LegView& leg, double share) {
    return (leg.tip_depth_mm + share * leg.insertion_mm * leg.heading_z + p[3]) / p[2];
  }
  // How much of the force cut the tissue that the tip is at.
  static double cut_by(const LegView& leg, double share) {
    const double in_mm = leg.tip_depth_mm.value + share * leg.insertion_mm.value * leg.heading_z.value;
    return std::clamp(in_mm / kBevel_mm, 0.0, 1.0);
  }
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
