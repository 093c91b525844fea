// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <numbers>

namespace bevel::model {
namespace {

// Breathing, or a rig that sways: p += A sin(2 pi f t + phase), along one lateral direction. Breathing is of 0.18 to
// 0.4 Hz in the field; below 0.1 a recording of some seconds shows no period.
class TissueMotion final : public Effect {
 public:
  TissueMotion()
      : Effect({.name = "tissue_motion",
                .meaning = "tissue or camera swings periodically",
                .covariate = Covariate::time_s,
                .parameters = {
                    {.name = "amplitude_mm", .lower = 0, .upper = 40, .none = 0, .starts = {0.4}, .reported = 5},
                    {.name = "frequency_hz",
                     .lower = 0.1,
                     .upper = 2,
                     .none = kNoNone,
                     .starts = {0.12, 0.15, 0.18, 0.21, 0.24, 0.27, 0.30, 0.33, 0.36, 0.39, 0.42, 0.46, 0.5, 0.55, 0.6},
                     .likely_low = 0.1,
                     .likely_high = 0.6,
                     .frequency = true},
                    {.name = "direction_rad",
                     .lower = 0,
                     .upper = std::numbers::pi,
                     .none = kNoNone,
                     .starts = {0, 1.05, 2.09},
                     .periodic = true,
                     .half_turns = 3},
                    {.name = "phase_rad",
                     .lower = 0,
                     .upper = 2 * std::numbers::pi,
                     .none = kNoNone,
                     .starts = {0, 1.05, 2.09, 3.14, 4.19, 5.24},
                     .scope = Scope::recording,
                     .periodic = true}}}) {}

  void offset(Parameters p, const EffectMemory& /*memory*/, double time_s, Dual3& position_mm) const override {
    const Dual swing = p[0] * sin(2 * std::numbers::pi * time_s * p[1] + p[3]);
    position_mm[0] += swing * cos(p[2]);
    position_mm[1] += swing * sin(p[2]);
  }
};

}  // namespace

const Effect& tissue_motion() {
  static const TissueMotion effect;
  return effect;
}

}  // namespace bevel::model
