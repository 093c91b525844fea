// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// Slip along the tilt, or in the bevel plane: the other one than the model file says.
class SlipDirectionOther final : public Effect {
 public:
  SlipDirectionOther()
      : Effect({.name = "slip_direction",
                .meaning = "the tip slips the other way than the model file says",
                .covariate = Covariate::roll_rad,
                .parameters = {}}) {}

  void change_needle(NeedleParameters& needle) const override {
    needle.slip = needle.slip == SlipDirection::isotropic ? SlipDirection::bevel_plane : SlipDirection::isotropic;
  }
};

}  // namespace

const Effect& slip_direction() {
  static const SlipDirectionOther effect;
  return effect;
}

}  // namespace bevel::model
