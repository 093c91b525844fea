// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The sensor of the heading sits askew in the needle: what it reports is the heading of {B} turned by this rotation
// vector in {B}. It turns with the roll; the path knows nothing of it.
class SensorTilt final : public Effect {
 public:
  SensorTilt()
      : Effect(
            {.name = "sensor_tilt",
             .meaning = "the sensor of the heading sits askew in the needle",
             .covariate = Covariate::roll_rad,
             .parameters =
                 {{.name = "about_x_rad", .lower = -0.5, .upper = 0.5, .none = 0, .starts = {0.01}, .reported = 0.07},
                  {.name = "about_y_rad", .lower = -0.5, .upper = 0.5, .none = 0, .starts = {0.01}, .reported = 0.07}},
             .of_headings = true}) {}

  void sensor(Parameters p, const EffectMemory& /*memory*/, Dual2& tilt_rad) const override {
    for (std::size_t i = 0; i < 2; ++i) tilt_rad[i] += p[i];
  }
};

}  // namespace

const Effect& sensor_tilt() {
  static const SensorTilt effect;
  return effect;
}

}  // namespace bevel::model
