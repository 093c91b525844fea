// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <algorithm>

namespace bevel::model {
namespace {

// Faster is straighter: k -> k (v / 10 mm/s)^-exponent, v = |u1|. Below kSlowest the law is not continued: it would
// grow without bound.
class RateDependence final : public Effect {
 public:
  RateDependence()
      : Effect({.name = "rate_dependence",
                .meaning = "the curvature depends on the speed of insertion",
                .covariate = Covariate::speed_mm_s,
                .parameters = {
                    {.name = "exponent", .lower = -1, .upper = 1, .none = 0, .starts = {0.1}, .reported = 0.35}}}) {}

  void curvature(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual2& kappa_per_mm) const override {
    if (leg.base_insertion_mm() == 0) return;
    const Dual factor = exp(p[0] * -std::log(std::max(leg.speed_mm_s(), kSlowest_mm_s) / 10));
    for (Dual& k : kappa_per_mm) k = k * factor;
  }

 private:
  static constexpr double kSlowest_mm_s = 0.2;
};

}  // namespace

const Effect& rate_dependence() {
  static const RateDependence effect;
  return effect;
}

}  // namespace bevel::model
