// SPDX-License-Identifier: MIT
// A drive that never receives its RPDO, while all else goes through: heartbeats, SYNC, SDO, its positions.
#include <gmock/gmock.h>

#include <cstdio>

#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

class UnheardStop : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(bench.enable()) << to_string(bench.reason());
    bench.move(10.0, 3.0);
    bench.run_ms(400);
    ASSERT_GT(bench.insertion.velocity_unit_s(), 9.0);
  }

  void lose_commands(std::uint32_t id) {
    bench.wire.set_tap([id](can::Frame& frame) { return frame.id != id; });
    bench.run_ms(200);  // at a constant rate nothing shows
    ASSERT_EQ(bench.report().state, DriverState::enabled);
  }

  void expect_rest_within_ms(int limit_ms) {
    const auto ms = bench.ms_to_rest();
    ASSERT_TRUE(ms.has_value());
    EXPECT_LE(*ms, limit_ms);
    std::printf("%s: at rest after %d ms\n", testing::UnitTest::GetInstance()->current_test_info()->name(), *ms);
  }

  void expect_latched(StopReason reason) {
    const double before_mm = bench.insertion.position_unit(), before_rad = bench.rotation.position_unit();
    bench.run_ms(1000);
    EXPECT_EQ(bench.reason(), reason);
    EXPECT_EQ(bench.report().state, DriverState::fault);
    EXPECT_NEAR(bench.insertion.position_unit(), before_mm, 0.2);  // the last of the ramp
    EXPECT_NEAR(bench.rotation.position_unit(), before_rad, 0.2);
  }

  // The line is whole again, and nothing moves until it is armed anew; then it does.
  void expect_rearm_works() {
    const double before_mm = bench.insertion.position_unit();
    bench.wire.set_tap({});
    bench.run_ms(1000);
    EXPECT_EQ(bench.report().state, DriverState::fault);
    ASSERT_TRUE(bench.driver->rearm());
    ASSERT_TRUE(bench.enable()) << to_string(bench.reason());
    EXPECT_NEAR(bench.insertion.position_unit(), before_mm, 1e-3);
    EXPECT_NEAR(bench.report().insertion_mm, before_mm, 0.05) << "its position was not lost";
    bench.run_ms(400);
    EXPECT_GT(bench.insertion.position_unit(), before_mm + 1.0);
  }

  Bench bench;
};

TEST_F(UnheardStop, IsOrderedBySdo) {
  lose_commands(0x202);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  expect_rest_within_ms(100);
  expect_latched(StopReason::operator_stop);
  EXPECT_EQ(bench.report().counters.stops_escalated, 1U);
  EXPECT_EQ(bench.report().rest[0], stepper::AxisRest::at_rest);
  EXPECT_THAT(describe(bench.report()), testing::HasSubstr("rotation DID NOT SLOW"));
  expect_rearm_works();
}

TEST_F(UnheardStop, EndsInTheDrivesOwnWatch) {
  bench.wire.set_tap([](can::Frame& frame) { return frame.id != 0x202 && frame.id != 0x602 && frame.id != 0x000; });
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  expect_rest_within_ms(200);
  expect_latched(StopReason::operator_stop);
  EXPECT_EQ(bench.report().counters.heartbeats_withheld, 1U);
  EXPECT_TRUE(bench.report().heartbeat_ended);
  expect_rearm_works();
}

TEST_F(UnheardStop, DisabledIsALatchedStop) {
  lose_commands(0x201);
  bench.driver->disable();
  expect_rest_within_ms(200);  // the reaction and the quick stop after it
  expect_latched(StopReason::does_not_stop);
  EXPECT_EQ(bench.report().stop.axis, 0);
  expect_rearm_works();
}

TEST_F(UnheardStop, OneThatIsHeardKeepsOurHeartbeat) {
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(1000);
  EXPECT_EQ(bench.report().counters.heartbeats_withheld, 0U);
  EXPECT_THAT(bench.report().error_code, testing::Each(0));
  EXPECT_FALSE(bench.report().heartbeat_ended);
  EXPECT_THAT(bench.report().rest, testing::Each(stepper::AxisRest::at_rest));
}

}  // namespace
}  // namespace bevel::test
