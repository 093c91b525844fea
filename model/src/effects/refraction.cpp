// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The gel's window bends light: radial about (y, z) = (0, centre), r -> r (1 + c r^2 / (50 mm)^2).
class Refraction final : public Effect {
 public:
  Refraction()
      : Effect({.name = "refraction",
                .meaning = "light is bent at the window of the tissue",
                .covariate = Covariate::depth_mm,
                .parameters = {
                    {.name = "coefficient", .lower = -0.3, .upper = 0.3, .none = 0, .starts = {0.02}, .reported = 0.04},
                    {.name = "centre_mm",
                     .lower = -100,
                     .upper = 300,
                     .none = kNoNone,
                     .starts = {0, 25, 50, 75},
                     .likely_low = 0,
                     .likely_high = kLongestNeedle_mm}}}) {}

  void camera(Parameters p, Dual3& position_mm) const override {
    const Dual y = position_mm[1];
    const Dual z = position_mm[2] - p[1];
    const Dual grow = p[0] * (y * y + z * z) * (1.0 / (50 * 50));
    position_mm[1] += y * grow;
    position_mm[2] += z * grow;
  }
};

}  // namespace

const Effect& refraction() {
  static const Refraction effect;
  return effect;
}

}  // namespace bevel::model
