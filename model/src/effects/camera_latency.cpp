// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The stamp is late: a reading stamped t shows the needle of t - latency.
class CameraLatency final : public Effect {
 public:
  CameraLatency()
      : Effect({.name = "camera_latency",
                .meaning = "pictures are stamped later than they were taken",
                .covariate = Covariate::speed_mm_s,
                .parameters = {
                    {.name = "latency_s", .lower = 0, .upper = 1, .none = 0, .starts = {0.05}, .reported = 0.2}}}) {}

  Dual latency_s(Parameters p) const override { return p[0]; }
};

}  // namespace

const Effect& camera_latency() {
  static const CameraLatency effect;
  return effect;
}

}  // namespace bevel::model
