// SPDX-License-Identifier: MIT
// A bad line by the kernel itself: the driver on one end of a vxcan pair, the drives on the other, and netem between
// them. (On a vcan netem changes nothing: what its sockets hear never passes a queue.) Run through on_can.sh.
#include <cstdlib>
#include <string>

#include "tests/drives/driven_line.hpp"

namespace bevel::test {
namespace {

const std::string kDriverEnd = "bevelx0", kDriveEnd = "bevelx1";

class Vxcan : public DrivenLine {
 protected:
  void SetUp() override {
    if (!ip("link add " + kDriverEnd + " type vxcan peer name " + kDriveEnd) || !ip("link set " + kDriverEnd + " up") ||
        !ip("link set " + kDriveEnd + " up"))
      GTEST_SKIP() << "SKIPPED: this kernel has no vxcan, or it is not permitted to add one";
    if (!repair()) GTEST_SKIP() << "SKIPPED: this kernel has no netem, or there is no tc";
    start(kDriverEnd, kDriveEnd);
  }
  void TearDown() override { ip("link del " + kDriverEnd); }

  // What leaves at this end: netem's own words.
  static bool spoil(const std::string& end, const std::string& how) {
    return std::system(("tc qdisc replace dev " + end + " root netem limit 10000 " + how + " 2>/dev/null").c_str()) ==
           0;
  }
  static bool spoil_both(const std::string& how) { return spoil(kDriverEnd, how) && spoil(kDriveEnd, how); }
  bool repair() override { return spoil_both("loss 0%"); }
};

TEST_F(Vxcan, AFewFramesLostAreBorne) {
  ASSERT_TRUE(spoil_both("loss 1%"));
  expect_borne();
}

TEST_F(Vxcan, AFewFramesDoubledAreBorne) {
  ASSERT_TRUE(spoil_both("duplicate 1%"));
  expect_borne();
}

TEST_F(Vxcan, AllFramesDoubledIsALatchedStop) {
  ASSERT_TRUE(spoil_both("duplicate 100%"));
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::second_drive);
}

TEST_F(Vxcan, FramesLateByLessThanAPeriodAreBorne) {
  ASSERT_TRUE(spoil_both("delay 5ms 3ms"));
  expect_borne();
}

TEST_F(Vxcan, AnswersLostAreALatchedStop) {
  ASSERT_TRUE(spoil(kDriveEnd, "loss 100%"));
  expect_latched_at_rest();
  EXPECT_THAT(stop().reason, testing::AnyOf(StopReason::pdo_lost, StopReason::drive_heartbeat_lost));
}

// The drives hear nothing, and stop by themselves; what they say about it is the driver's stop.
TEST_F(Vxcan, CommandsLostStopTheDrivesByThemselves) {
  ASSERT_TRUE(spoil(kDriverEnd, "loss 100%"));
  EXPECT_TRUE(run_until([this] { return at_rest(); }, 3000));
  EXPECT_EQ(insertion->state(), rig::PowerStateMachine::State::quick_stop_active);
  EXPECT_EQ(rotation->state(), rig::PowerStateMachine::State::quick_stop_active);
  expect_latched_at_rest();
}

TEST_F(Vxcan, AnswersLateByMoreThanTheirTimeOutAreALatchedStop) {
  ASSERT_TRUE(spoil(kDriveEnd, "delay 600ms"));
  expect_latched_at_rest();
  EXPECT_THAT(stop().reason, testing::AnyOf(StopReason::pdo_lost, StopReason::drive_heartbeat_lost));
}

// Commands that wait in the kernel, with velocities of before the stop among them: once the stop has come through, no
// old one moves anything.
TEST_F(Vxcan, CommandsLateByHalfASecondStopLaterAndForGood) {
  ASSERT_TRUE(spoil(kDriverEnd, "delay 500ms"));
  run_ms(100);
  master->driver.stop_now(StopReason::operator_stop, clock_.now_ns());
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::operator_stop);
}

// One bit in any part of the frame: another identifier, another length, another value. Borne or stopped; and the
// controller's zero is obeyed, or the stop.
TEST_F(Vxcan, CorruptedFramesNeverLetTheAxesRunOn) {
  ASSERT_TRUE(spoil_both("corrupt 3%"));
  run_ms(3000);
  master->driver.stop_now(StopReason::operator_stop, clock_.now_ns());
  expect_latched_at_rest();
}

}  // namespace
}  // namespace bevel::test
