// SPDX-License-Identifier: MIT
// The driver against two simulated drives, without faults: states, positions, limits, set-point ages.
#include <gmock/gmock.h>

#include <limits>

#include <bevel/error.hpp>
#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using stepper::AxisStatus;
using stepper::EnableAnswer;
using stepper::MotionSetpoint;

TEST(Motion, NothingIsSentWhileListeningAndNothingMovesBeforeEnable) {
  Bench bench;
  bench.move(5.0, 1.0);
  bench.run_ms(290);
  EXPECT_EQ(bench.driver_bus->counters().sent, 0U);
  ASSERT_TRUE(bench.reach(DriverState::ready));
  bench.run_ms(500);
  EXPECT_EQ(bench.report().state, DriverState::ready);
  EXPECT_EQ(bench.insertion.position_unit(), 0.0);
  EXPECT_EQ(bench.rotation.position_unit(), 0.0);
  EXPECT_EQ(bench.report().status[0], AxisStatus::ready);
}

TEST(Motion, EnableIsRefusedUntilReady) {
  Bench bench;
  bench.run_ms(20);
  EXPECT_EQ(bench.driver->enable(), EnableAnswer::not_ready);
}

TEST(Motion, BothAxesFollowAndTheReportAgreesWithTheShafts) {
  Bench bench;
  ASSERT_TRUE(bench.enable()) << to_string(bench.reason());
  bench.move(5.0, -2.0);
  bench.run_ms(1000);
  const auto report = bench.report();
  EXPECT_EQ(report.state, DriverState::enabled);
  EXPECT_EQ(report.status, (std::array{AxisStatus::enabled, AxisStatus::enabled}));
  EXPECT_NEAR(report.insertion_rate_mm_s, 5.0, 0.01);
  EXPECT_NEAR(report.rotation_rate_rad_s, -2.0, 0.01);
  // The position belongs to its stamp: carried on to now at the known rate it is that of the shaft.
  const double age_s = static_cast<double>(bench.now_ns - report.sampled_ns) * 1e-9;
  EXPECT_LE(age_s, 0.03);
  EXPECT_NEAR(report.insertion_mm + 5.0 * age_s, bench.insertion.position_unit(), 0.011);
  EXPECT_NEAR(report.rotation_rad - 2.0 * age_s, bench.rotation.position_unit(), 0.005);
  EXPECT_NEAR(report.insertion_mm, 5.0, 0.3);
}

TEST(Motion, DisableRampsDownAndGoesBackToReady) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(500);
  bench.driver->disable();
  EXPECT_TRUE(bench.ms_to_rest(300).has_value());
  bench.run_ms(100);
  EXPECT_EQ(bench.report().state, DriverState::ready);
  EXPECT_EQ(bench.reason(), StopReason::none);
  EXPECT_EQ(bench.report().status[0], AxisStatus::ready);
}

TEST(Motion, NegativeCountsPerUnitTurnTheDirection) {
  stepper::StepperConfig config;
  config.axes[0].counts_per_unit *= -1.0;
  Bench bench(config);
  ASSERT_TRUE(bench.enable());
  bench.move(5.0, 0.0);
  bench.run_ms(500);
  EXPECT_GT(bench.report().insertion_mm, 1.0);
  EXPECT_NEAR(bench.report().insertion_rate_mm_s, 5.0, 0.01);
}

TEST(Motion, RatesAndAccelerationsStayWithinTheirLimits) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  double fastest = 0.0;
  double steepest = 0.0;
  double before = 0.0;
  int ticks = 0;
  bench.each_ms = [&] {
    const double rate = bench.insertion.velocity_unit_s();
    fastest = std::max(fastest, std::abs(rate));
    if (ticks++ > 0) steepest = std::max(steepest, std::abs(rate - before) / 1e-3);
    before = rate;
  };
  bench.move(1e6, -1e6);
  bench.run_ms(500);
  bench.move(-1e6, 1e6);
  bench.run_ms(500);
  EXPECT_GT(fastest, 0.99 * bench.config.axes[0].rate_limit_unit_s);
  EXPECT_LE(fastest, 1.001 * bench.config.axes[0].rate_limit_unit_s);
  EXPECT_LE(steepest, 1.01 * bench.config.axes[0].acceleration_unit_s2);
  EXPECT_GT(bench.report().counters.setpoints_clamped, 0U);
}

TEST(Motion, TheWorkspaceIsNotLeft) {
  stepper::StepperConfig config;
  config.axes[0].position_min_unit = -1.0;
  config.axes[0].position_max_unit = 4.0;
  Bench bench(config);
  ASSERT_TRUE(bench.enable());
  double furthest = -1e9;
  bench.each_ms = [&] { furthest = std::max(furthest, bench.insertion.position_unit()); };
  bench.move(20.0, 0.0);
  bench.run_ms(2000);
  EXPECT_LE(furthest, 4.02);
  EXPECT_GT(furthest, 3.8);
  EXPECT_EQ(bench.report().state, DriverState::enabled);
  bench.move(-20.0, 0.0);
  bench.run_ms(2000);
  EXPECT_NEAR(bench.insertion.position_unit(), -1.0, 0.1);
}

TEST(Motion, PositionCountersMayWrap) {
  Bench bench;
  // The drive's counter starts 1000 counts short of its largest value.
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x281) stepper::cia301::put_u32(frame, 0, stepper::cia301::get_u32(frame, 0) + 0x7FFFFFFFU - 1000U);
    return true;
  });
  ASSERT_TRUE(bench.enable());
  bench.driver->set_zero();
  bench.move(5.0, 0.0);
  double before = 0.0;
  double largest_jump = 0.0;
  bench.each_ms = [&] {
    const double now = bench.report().insertion_mm;
    largest_jump = std::max(largest_jump, std::abs(now - before));
    before = now;
  };
  bench.run_ms(1000);
  EXPECT_NEAR(bench.report().insertion_mm, bench.insertion.position_unit(), 0.2);
  EXPECT_GT(bench.report().insertion_mm, 4.0);  // 8000 counts: past the wrap
  EXPECT_LT(largest_jump, 0.1);
}

TEST(Motion, SetZeroMovesTheOrigin) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.move(5.0, 0.0);
  bench.run_ms(500);
  bench.command = MotionSetpoint{};
  bench.run_ms(300);
  bench.driver->set_zero();
  EXPECT_EQ(bench.report().insertion_mm, 0.0);
}

TEST(Setpoints, AgeGivesZeroRateThenALatchedQuickStop) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(400);
  const std::int64_t silent_since_ns = bench.now_ns;
  bool slowed_while_enabled = false;
  bench.each_ms = [&] {
    bench.command->age_ns = bench.now_ns - silent_since_ns;
    if (bench.report().state == DriverState::enabled && bench.insertion.velocity_unit_s() < 9.0)
      slowed_while_enabled = true;
  };
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 200);
  EXPECT_TRUE(slowed_while_enabled);
  bench.run_ms(200);
  EXPECT_EQ(bench.report().state, DriverState::stopped);
  EXPECT_EQ(bench.reason(), StopReason::setpoint_stale);
  bench.each_ms = nullptr;
  bench.move(10.0, 3.0);  // fresh again: nothing re-arms by itself
  bench.run_ms(500);
  EXPECT_TRUE(bench.at_rest());
}

TEST(Setpoints, ThatOfBeforeAStopMovesNothingWhenTheAxesAreEnabledAgain) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(400);
  const std::int64_t made_ns = bench.now_ns;  // the last one: who sends them is silent from here on
  bench.each_ms = [&] { bench.command->age_ns = bench.now_ns - made_ns; };
  ASSERT_TRUE(bench.ms_to_rest().has_value());
  bench.run_ms(300);
  ASSERT_EQ(bench.reason(), StopReason::setpoint_stale);
  double fastest_unit_s = 0;
  bench.each_ms = [&] {
    bench.command->age_ns = bench.now_ns - made_ns;
    for (const auto* axis : {&bench.insertion, &bench.rotation})
      fastest_unit_s = std::max(fastest_unit_s, std::abs(axis->velocity_unit_s()));
  };
  bench.driver->rearm();
  ASSERT_TRUE(bench.enable());
  bench.run_ms(500);
  EXPECT_LT(fastest_unit_s, 0.01);
  EXPECT_EQ(bench.reason(), StopReason::setpoint_stale) << "nobody commands: the axes are switched off again";
}

TEST(Setpoints, NoneAtAllStopsTheAxesToo) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(400);
  bench.command.reset();
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 200);
  bench.run_ms(100);
  EXPECT_EQ(bench.reason(), StopReason::setpoint_stale);
}

class InvalidSetpoint : public testing::TestWithParam<MotionSetpoint> {};

TEST_P(InvalidSetpoint, StopsAtOnceAndLatchesWhenItPersists) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(400);
  bench.command = GetParam();
  bench.run_ms(20);
  EXPECT_EQ(bench.report().state, DriverState::enabled);  // one bad message is no reason to let go
  EXPECT_LT(bench.insertion.velocity_unit_s(), 9.9);      // but no reason to go on either
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 200);
  bench.run_ms(200);
  EXPECT_EQ(bench.reason(), StopReason::setpoint_invalid);
  EXPECT_GT(bench.report().counters.setpoints_refused, 0U);
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
INSTANTIATE_TEST_SUITE_P(EveryField, InvalidSetpoint,
                         testing::Values(MotionSetpoint{0, true, kNan, 0.0}, MotionSetpoint{0, true, 0.0, kNan},
                                         MotionSetpoint{0, true, kInf, 0.0}, MotionSetpoint{0, true, 0.0, -kInf},
                                         MotionSetpoint{0, false, kNan, 0.0},
                                         MotionSetpoint{-3600'000 * kMs, true, 1.0, 1.0}));

TEST(Configuration, ProblemsNameKeyValueAndRange) {
  stepper::StepperConfig config;
  config.axes[1].node_id = config.axes[0].node_id;
  config.axes[0].counts_per_unit = 0.0;
  config.drive_heartbeat_timeout_ns = 1;
  EXPECT_THAT(stepper::problems_of(config),
              testing::UnorderedElementsAre(testing::HasSubstr("rotation.node_id = 1"),
                                            testing::HasSubstr("insertion.counts_per_unit = 0"),
                                            testing::HasSubstr("drive_heartbeat_timeout_ms = 1e-06")));
  can::MemoryNetwork wire;
  const auto bus = wire.attach();
  EXPECT_THROW(stepper::StepperDriver(*bus, config), bevel::ArgumentError);
  EXPECT_TRUE(stepper::problems_of(stepper::StepperConfig{}).empty());
}

}  // namespace
}  // namespace bevel::test
