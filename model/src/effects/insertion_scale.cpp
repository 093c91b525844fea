// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// The tip advances by a share of what the base does (slip of the clamp, axial compression): s = ratio d. Both causes
// lose way; a ratio above one would be a drive with a wrong count of steps.
class InsertionScale final : public Effect {
 public:
  InsertionScale()
      : Effect({.name = "insertion_scale",
                .meaning = "the tip advances by a fixed share of what the drive does",
                .covariate = Covariate::depth_mm,
                .parameters = {{.name = "ratio",
                                .lower = 0.3,
                                .upper = 1.7,
                                .none = 1,
                                .starts = {0.95},
                                .reported = 0.15,
                                .largest_seen = 1}}}) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& /*memory*/, Dual& insertion_mm,
            Dual& /*rotation_rad*/) const override {
    insertion_mm += (p[0] - 1.0) * (insertion_mm - leg.entry.insertion_mm);
  }
};

}  // namespace

const Effect& insertion_scale() {
  static const InsertionScale effect;
  return effect;
}

}  // namespace bevel::model
