// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The cameras' frame is turned, about x and about y: a reading is R_y^T R_x^T p, a heading likewise. In kinds: a camera
// that looks along x and is turned about its optical axis, one that looks along y, or both, a frame askew as a whole.
class CameraRotation final : public Effect {
 public:
  CameraRotation()
      : Effect({.name = "camera_rotation",
                .meaning = "the camera's frame is turned",
                .covariate = Covariate::depth_mm,
                .parameters = {{.name = "about_x_rad",
                                .lower = -0.5,
                                .upper = 0.5,
                                .none = 0,
                                .starts = {0.01},
                                .reported = 0.05,
                                .usual = 0},
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
  std::span<const std::uint32_t> variants() const override {
    static constexpr std::uint32_t kKinds[] = {0b01, 0b10, 0b11};
    return kKinds;
  }
};

}  // namespace

const Effect& camera_rotation() {
  static const CameraRotation effect;
  return effect;
}

}  // namespace bevel::model
