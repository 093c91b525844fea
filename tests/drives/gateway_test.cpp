// SPDX-License-Identifier: MIT
// A CAN gateway between driver and drives that sends on what it likes: the kernel's own (can-gw) between two vcans.
// netem (vxcan_test.cpp) loses frames by chance; this loses one kind of frame and lets all others through. Run through
// on_can.sh.
#include <gmock/gmock.h>
#include <linux/can.h>

#include <cstdint>
#include <string>

#include "tests/drives/can_gateway.hpp"
#include "tests/drives/driven_line.hpp"

namespace bevel::test {
namespace {

const std::string kDriverSide = "bevelg0", kDriveSide = "bevelg1";

// CiA 301: identifiers of node 1, insertion, and node 2, rotation.
constexpr std::uint32_t kNode1PositionPdo = 0x181, kNode2CommandPdo = 0x202, kNode2Heartbeat = 0x702;

class Gateway : public DrivenLine {
 protected:
  void SetUp() override {
    for (const auto& side : {kDriverSide, kDriveSide})
      if (!ip("link add " + side + " type vcan") || !ip("link set " + side + " up"))
        GTEST_SKIP() << "SKIPPED: this kernel has no vcan, or it is not permitted to add one";
    if (const int error = gateway_.add(commands_); error != 0)
      GTEST_SKIP() << "SKIPPED: this kernel has no can-gw, or it is not permitted (" << strerror(error) << ")";
    ASSERT_EQ(gateway_.add(answers_), 0);
    start(kDriverSide, kDriveSide);
  }
  void TearDown() override {
    for (const auto& side : {kDriverSide, kDriveSide}) ip("link del " + side);
  }

  // From now on, all but frames of this identifier.
  void drop(CanGateway::Rule& direction, std::uint32_t id) {
    const CanGateway::Rule all_but{direction.from, direction.to, id | CAN_INV_FILTER, CAN_SFF_MASK};
    ASSERT_EQ(gateway_.add(all_but), 0);
    ASSERT_EQ(gateway_.remove(direction), 0);
    direction = all_but;
  }
  bool repair() override {
    bool repaired = ip("link set " + kDriveSide + " up");
    for (auto* direction : {&commands_, &answers_}) {
      const CanGateway::Rule all{direction->from, direction->to};
      if (direction->mask == 0) continue;
      repaired = gateway_.add(all) == 0 && gateway_.remove(*direction) == 0 && repaired;
      *direction = all;
    }
    return repaired;
  }
  CanGateway::Counters counted(const CanGateway::Rule& direction) {
    return gateway_.counters(direction.from, direction.to).value();
  }

  CanGateway gateway_;
  CanGateway::Rule commands_{kDriverSide, kDriveSide}, answers_{kDriveSide, kDriverSide};
};

// The way itself: every frame came through the kernel's gateway, and it dropped none.
TEST_F(Gateway, AllThroughIsBorne) {
  const auto before = counted(commands_);
  expect_borne();
  for (const auto& direction : {commands_, answers_}) {
    EXPECT_EQ(counted(direction).rules, 1U);
    EXPECT_EQ(counted(direction).dropped, 0U);
    EXPECT_GT(counted(direction).handled, 300U);
  }
  // In 3 s, at a period of 10 ms: 600 commands, 300 SYNC, 100 heartbeats; fewer where the guest stands still at times.
  EXPECT_GT(counted(commands_).handled, before.handled + 300U);
}

TEST_F(Gateway, PositionsOfOneDriveDroppedAreALatchedStopOfBoth) {
  drop(answers_, kNode1PositionPdo);
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::pdo_lost);
  EXPECT_EQ(stop().axis, 0);
}

TEST_F(Gateway, HeartbeatsOfOneDriveDroppedAreALatchedStopOfBoth) {
  drop(answers_, kNode2Heartbeat);
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::drive_heartbeat_lost);
  EXPECT_EQ(stop().axis, 1);
}

// The stop of one drive never arrives, and all else does: heartbeats, SYNC, its positions.
TEST_F(Gateway, CommandsOfOneDriveDroppedDoNotKeepItFromStopping) {
  drop(commands_, kNode2CommandPdo);
  run_ms(500);
  master->driver.stop_now(StopReason::operator_stop, clock_.now_ns());
  expect_latched_at_rest();
  EXPECT_EQ(stop().reason, StopReason::operator_stop);
}

// The far segment is down: what the kernel counts as dropped, and the driver hears no more of the drives.
TEST_F(Gateway, AFarSegmentThatIsDownIsALatchedStopOfBoth) {
  ASSERT_TRUE(ip("link set " + kDriveSide + " down"));
  EXPECT_TRUE(run_until([this] { return state() >= DriverState::stopped; }, 3000));
  EXPECT_GT(counted(commands_).dropped, 0U);
  expect_latched_at_rest();
  EXPECT_THAT(stop().reason, testing::AnyOf(StopReason::pdo_lost, StopReason::drive_heartbeat_lost));
}

}  // namespace
}  // namespace bevel::test
