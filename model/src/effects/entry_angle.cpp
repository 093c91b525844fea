// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The needle enters tilted: the initial heading is z_A turned by this rotation vector.
class EntryAngle final : public Effect {
 public:
  EntryAngle()
      : Effect({.name = "entry_angle",
                .meaning = "the needle enters the tissue at an angle",
                .covariate = Covariate::depth_mm,
                .parameters = {
                    {.name = "about_x_rad", .lower = -0.5, .upper = 0.5, .none = 0, .starts = {0.01}, .reported = 0.08},
                    {.name = "about_y_rad",
                     .lower = -0.5,
                     .upper = 0.5,
                     .none = 0,
                     .starts = {0.01},
                     .reported = 0.08}}}) {}

  void enter(Parameters p, EntryPose& pose) const override {
    pose.tilt_x_rad += p[0];
    pose.tilt_y_rad += p[1];
  }
};

}  // namespace

const Effect& entry_angle() {
  static const EntryAngle effect;
  return effect;
}

}  // namespace bevel::model
