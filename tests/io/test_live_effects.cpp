// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bevel/error.hpp>
#include <bevel/io/live_effects.hpp>

namespace bevel::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(LiveEffects, effects_with_an_unknown_of_the_recording_are_left_out_by_name) {
  const LiveEffects live =
      live_effects({{"tissue_motion", {{"amplitude_mm", 0.5}, {"frequency_hz", 0.25}, {"direction_rad", 0.3}}, {}},
                    {"drilling", {{"coefficient_mm_per_rad", 1.5}}, {}},
                    {"lost_steps", {{"rotation_rad", 0.8}}, {{"rec01.lcm", {{"at_s", 3}}}}}});
  ASSERT_EQ(live.active.size(), 1U);
  EXPECT_EQ(live.active[0].effect->name(), "drilling");
  EXPECT_EQ(live.active[0].parameters[0].value, 1.5);
  EXPECT_THAT(live.left_out, ElementsAre(AllOf(HasSubstr("tissue_motion"), HasSubstr("phase_rad")),
                                         AllOf(HasSubstr("lost_steps"), HasSubstr("at_s"))));
}

TEST(LiveEffects, what_is_known_beforehand_is_all_there) {
  EXPECT_THAT(unknown_beforehand({"drilling", {}, {}}), IsEmpty());
  EXPECT_THAT(live_effects({}).active, IsEmpty());
  const LiveEffects live = live_effects({{"rotation_backlash", {{"width_rad", 0.4}}, {}}, {"slip_direction", {}, {}}});
  EXPECT_EQ(live.active.size(), 2U);
  EXPECT_THAT(live.left_out, IsEmpty());
  EXPECT_THROW(live_effects({{"no_such_effect", {}, {}}}), bevel::ArgumentError);
}

}  // namespace
}  // namespace bevel::io
