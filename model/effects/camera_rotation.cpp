#include "model/effects/effect.hpp"

namespace bevel::model {
namespace {

// The camera that looks along x is turned about its optical axis by this angle: a reading is R_x(angle)^T p.
class CameraRotation final : public Effect {
 public:
  CameraRotation()
      : Effect({.name = "camera_rotation",
                .meaning = "the camera is turned about its optical axis",
                .covariate = Covariate::depth_mm,
                .parameters = {{.name = "about_x_rad",
                                .lower = -0.5,
                                .upper = 0.5,
                                .none = 0,
                                .starts = {0.01},
                                .reported = 0.05}}}) {}

  void camera(Parameters p, Dual3& position_mm) const override {
    const Dual2 yz = turned({position_mm[1], position_mm[2]}, -p[0]);
    position_mm[1] = yz[0];
    position_mm[2] = yz[1];
  }
};

}  // namespace

const Effect& camera_rotation() {
  static const CameraRotation effect;
  return effect;
}

}  // namespace bevel::model
