// A drive that never receives its commands, while all else goes through: heartbeats, SYNC, its positions. Only its
// statusword tells that it does not obey.
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
    EXPECT_EQ(bench.report().state, DriverState::stopped);
    EXPECT_NEAR(bench.insertion.position_unit(), before_mm, 0.2);  // the last of the ramp
    EXPECT_NEAR(bench.rotation.position_unit(), before_rad, 0.2);
  }

  // The line is whole again, and nothing moves until it is armed anew; then it does.
  void expect_rearm_works() {
    const double before_mm = bench.insertion.position_unit();
    bench.wire.set_tap({});
    bench.run_ms(1000);
    EXPECT_EQ(bench.report().state, DriverState::stopped);
    ASSERT_TRUE(bench.driver->rearm());
    ASSERT_TRUE(bench.enable()) << to_string(bench.reason());
    EXPECT_NEAR(bench.insertion.position_unit(), before_mm, 1e-3);
    EXPECT_NEAR(bench.report().insertion_mm, before_mm, 0.05) << "its position was not lost";
    bench.run_ms(400);
    EXPECT_GT(bench.insertion.position_unit(), before_mm + 1.0);
  }

  Bench bench;
};

TEST_F(UnheardStop, EndsInTheDrivesOwnWatch) {
  lose_commands(0x202);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  expect_rest_within_ms(200);
  expect_latched(StopReason::operator_stop);
  EXPECT_EQ(bench.report().counters.heartbeats_withheld, 1U);
  EXPECT_THAT(bench.report().stop_unconfirmed, testing::ElementsAre(false, true));
  EXPECT_THAT(describe(bench.report().stop, bench.report().stop_unconfirmed), testing::HasSubstr("rotation's drive"));
  expect_rearm_works();
}

TEST_F(UnheardStop, DisabledIsALatchedStop) {
  lose_commands(0x201);
  bench.driver->disable();
  expect_rest_within_ms(400);  // the time of a ramp more
  expect_latched(StopReason::not_following);
  EXPECT_EQ(bench.report().stop.axis, 0);
  expect_rearm_works();
}

TEST_F(UnheardStop, OneThatIsHeardKeepsOurHeartbeat) {
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(1000);
  EXPECT_EQ(bench.report().counters.heartbeats_withheld, 0U);
  EXPECT_THAT(bench.report().error_code, testing::Each(0));
  EXPECT_THAT(bench.report().stop_unconfirmed, testing::Each(false));
}

}  // namespace
}  // namespace bevel::test
