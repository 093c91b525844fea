// SPDX-License-Identifier: MIT
// A leg and a reading allocate nothing, with effects and sensitivities: operator new is counted.
#include <gtest/gtest.h>

#include "tests/effects/script.hpp"
#include "tests/support/count_allocations.hpp"

namespace bevel::model::testing {
namespace {

TEST(AugmentedNeedle, AllocatesNothingOnALeg) {
  const Motion motion = rich_script().recorded();
  const std::vector<ActiveEffect> all{
      active("rotation_backlash", {0.3}),      active("torsional_windup", {0.5}), active("puncture", {20, 2}),
      active("flip_transient", {6}),           active("lateral_bias", {1e-3, 0}), active("relaxation", {1, 2, 5}),
      active("tissue_motion", {1, 0.3, 0, 0}), active("refraction", {0.02, 30})};
  ASSERT_EQ(all.size(), static_cast<std::size_t>(kMaxEffects));
  for (const int columns : {0, kMaxColumns}) {
    const AugmentedNeedle needle(agar(), all, columns, columns ? NeedleColumns{0, 1, 2, 3} : NeedleColumns{});
    AugmentedState state = needle.entry(motion.nodes.front());
    TipReading reading;
    long legs = 0;
    const long before = bevel::testing::allocations;
    for (const BaseMotion& node : motion.nodes) {
      const AugmentedState kept = state;  // as a filter keeps its history
      legs += needle.advance(state, node) && kept.base.time_s <= state.base.time_s;
      needle.point(state, reading);
      needle.through_cameras(reading);
    }
    EXPECT_EQ(bevel::testing::allocations - before, 0);
    EXPECT_EQ(legs, static_cast<long>(motion.nodes.size()));
  }
}

TEST(OpenLoop, AllocatesNothingOnceItHasItsRoom) {
  const Motion motion = rich_script().recorded();
  ActiveEffect windup = active("torsional_windup", {0.5});
  windup.parameters[0] = Dual::unknown(0.5, 1);
  const AugmentedNeedle needle(agar(), {windup, active("camera_latency", {0.1})}, 2, {.curvature = 0});
  OpenLoop path;
  ASSERT_TRUE(predict(needle, motion, path));
  const long before = bevel::testing::allocations;
  ASSERT_TRUE(predict(needle, motion, path));
  EXPECT_EQ(bevel::testing::allocations - before, 0);
}

}  // namespace
}  // namespace bevel::model::testing
