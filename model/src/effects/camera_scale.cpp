// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// Wrong millimetres per pixel of the camera that looks along x: y and z read ratio times too large.
class CameraScale final : public Effect {
 public:
  CameraScale()
      : Effect({.name = "camera_scale",
                .meaning = "the camera reads too many or too few millimetres per pixel",
                .covariate = Covariate::depth_mm,
                .parameters = {
                    {.name = "ratio", .lower = 0.5, .upper = 2, .none = 1, .starts = {1.02}, .reported = 0.05}}}) {}

  void camera(Parameters p, Dual3& position_mm) const override {
    for (std::size_t i = 1; i < 3; ++i) position_mm[i] += (p[0] - 1.0) * position_mm[i];
  }
};

}  // namespace

const Effect& camera_scale() {
  static const CameraScale effect;
  return effect;
}

}  // namespace bevel::model
