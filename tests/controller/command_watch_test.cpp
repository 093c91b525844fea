// SPDX-License-Identifier: MIT
#include <bevel/controller/command_watch.hpp>

#include <gtest/gtest.h>

namespace bevel::controller {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
constexpr double kDelay_s = 0.12;

model::ActuatorState report(std::int64_t after_us, double insertion_mm_s, double rotation_rad_s = 0) {
  model::ActuatorState state;
  state.utime = kStart_utime + after_us;
  state.insertion_rate_mm_s = insertion_mm_s;
  state.rotation_rate_rad_s = rotation_rad_s;
  return state;
}

// 5 mm/s until 1 s, then 1 mm/s and 3 rad/s, every 10 ms until 1.5 s.
CommandWatch slowed_at_a_second() {
  CommandWatch watch;
  for (std::int64_t us = 0; us <= 1'500'000; us += 10'000)
    watch.remember(kStart_utime + us, us < 1'000'000 ? Rates{5, 0} : Rates{1, 3});
  return watch;
}

TEST(CommandWatch, BeforeAnythingWasCommandedNothingIsOff) {
  EXPECT_EQ(CommandWatch{}.excess(report(0, 7), kDelay_s).insertion_mm_s, 0);
  EXPECT_FALSE(CommandWatch{}.told_to_rest(kStart_utime, 0.1));
}

TEST(CommandWatch, AnAxisMayDoWhatWasInForceWithinItsDelayAndNothingElse) {
  const CommandWatch watch = slowed_at_a_second();
  EXPECT_EQ(watch.excess(report(1'110'000, 5), kDelay_s).insertion_mm_s, 0);
  EXPECT_EQ(watch.excess(report(1'110'000, 3, 1.5), kDelay_s).insertion_mm_s, 0) << "on the way between them";
  EXPECT_EQ(watch.excess(report(1'140'000, 5), kDelay_s).insertion_mm_s, 4);
  EXPECT_EQ(watch.excess(report(1'140'000, 0, -1), kDelay_s).insertion_mm_s, 1);
  EXPECT_EQ(watch.excess(report(1'140'000, 0, -1), kDelay_s).rotation_rad_s, 4);
}

// It is judged in the last of these steps, at 1.5 s, by then 390 ms old or 10: the commands of its own time count.
TEST(CommandWatch, ALateReportIsJudgedByTheCommandsOfItsTime) {
  const CommandWatch watch = slowed_at_a_second();
  EXPECT_EQ(watch.excess(report(1'110'000, 5), kDelay_s).insertion_mm_s, 0);
  EXPECT_EQ(watch.excess(report(1'490'000, 5), kDelay_s).insertion_mm_s, 4);
}

TEST(CommandWatch, RestIsRestForAllOfTheTime) {
  CommandWatch watch;
  watch.remember(kStart_utime, {1, 0});
  for (std::int64_t us = 10'000; us <= 300'000; us += 10'000) {
    watch.remember(kStart_utime + us, {});
    EXPECT_EQ(watch.told_to_rest(kStart_utime + us, 0.24), us >= 250'000) << us;
  }
  watch.remember(kStart_utime + 310'000, {0, 0.1});
  EXPECT_FALSE(watch.told_to_rest(kStart_utime + 310'000, 0.24));
  watch.restart();
  watch.remember(kStart_utime + 320'000, {});
  EXPECT_FALSE(watch.told_to_rest(kStart_utime + 320'000, 0.24)) << "not known for so long";
}

TEST(CommandWatch, RemembersLongEnoughAtTheShortestPeriod) {
  CommandWatch watch;
  for (std::int64_t us = 0; us <= 3'000'000; us += 2'000)
    watch.remember(kStart_utime + us, {us < 2'850'000 ? 5.0 : 1.0, 0});
  EXPECT_EQ(watch.excess(report(2'920'000, 5), kDelay_s).insertion_mm_s, 0);
  EXPECT_EQ(watch.excess(report(2'980'000, 5), kDelay_s).insertion_mm_s, 4);
}

}  // namespace
}  // namespace bevel::controller
