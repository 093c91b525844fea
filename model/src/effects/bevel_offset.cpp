// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <numbers>

namespace bevel::model {
namespace {

// The bevel does not face where the model thinks at the start.
class BevelOffset final : public Effect {
 public:
  BevelOffset()
      : Effect({.name = "bevel_offset",
                .meaning = "the bevel was mounted turned about the shaft",
                .covariate = Covariate::roll_rad,
                .parameters = {{.name = "roll_rad",
                                .lower = -std::numbers::pi,
                                .upper = std::numbers::pi,
                                .none = 0,
                                .starts = {0.1},
                                .reported = 0.6,
                                .periodic = true}}}) {}

  void enter(Parameters p, EntryPose& pose) const override { pose.roll_rad += p[0]; }
};

}  // namespace

const Effect& bevel_offset() {
  static const BevelOffset effect;
  return effect;
}

}  // namespace bevel::model
