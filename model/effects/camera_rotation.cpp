#include "model/effects/effect.hpp"

namespace bevel::model {
namespace {

// The camera's frame is turned, about its optical axis x and about y: a reading is R_y^T R_x^T p, a heading likewise.
class CameraRotation final : public Effect {
 public:
  CameraRotation()
      : Effect({.name = "camera_rotation",
                .meaning = "the camera's frame is turned",
                .covariate = Covariate::depth_mm,
                .parameters = {
                    {.name = "about_x_rad", .lower = -0.5, .upper = 0.5, .none = 0, .starts = {0.01}, .reported = 0.05},
                    {.name = "about_y_rad",
                     .lower = -0.5,
                     .upper = 0.5,
                     .none = 0,
                     .starts = {0.01},
                     .reported = 0.07,
                     .usual = 0}}}) {}

  void camera(Parameters p, Dual3& position_mm) const override { frame(p, position_mm); }
  void frame(Parameters p, Dual3& direction) const override {
    const Dual2 yz = turned({direction[1], direction[2]}, -p[0]);
    const Dual2 zx = turned({yz[1], direction[0]}, -p[1]);
    direction = {zx[1], yz[0], zx[0]};
  }
};

}  // namespace

const Effect& camera_rotation() {
  static const CameraRotation effect;
  return effect;
}

}  // namespace bevel::model
