// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {
namespace {

// Registration: every reading is shifted across by the same vector.
class EntryPoint final : public Effect {
 public:
  EntryPoint()
      : Effect(
            {.name = "entry_point",
             .meaning = "the entry point is not where it is taken to be",
             .covariate = Covariate::depth_mm,
             .parameters = {{.name = "x_mm", .lower = -50, .upper = 50, .none = 0, .starts = {0.5}, .reported = 2},
                            {.name = "y_mm", .lower = -50, .upper = 50, .none = 0, .starts = {0.5}, .reported = 2}}}) {}

  void offset(Parameters p, const EffectMemory& /*memory*/, double /*time_s*/, Dual3& position_mm) const override {
    for (std::size_t i = 0; i < 2; ++i) position_mm[i] += p[i];
  }
};

}  // namespace

const Effect& entry_point() {
  static const EntryPoint effect;
  return effect;
}

}  // namespace bevel::model
