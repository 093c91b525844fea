// SPDX-License-Identifier: MIT
// A stop counts when it is measured: drives that acknowledge a stop and do not carry it out, settings that change while
// the axes move, and drives that are lost after a stop.
#include <gmock/gmock.h>

#include <cstdio>

#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using stepper::AxisRest;
using stepper::StopOrder;
using testing::HasSubstr;

class MeasuredStop : public testing::Test {
 protected:
  void move(double insertion_mm_s = 10.0, double rotation_rad_s = 3.0) {
    ASSERT_TRUE(bench.enable()) << describe(bench.report());
    bench.move(insertion_mm_s, rotation_rad_s);
    bench.run_ms(400);
    ASSERT_NEAR(bench.insertion.velocity_unit_s(), insertion_mm_s, 0.1);
  }

  // ms from now until the driver reports `rest` of the insertion axis.
  int ms_until(AxisRest rest) {
    const std::int64_t begun_ns = bench.now_ns;
    EXPECT_TRUE(bench.run_until([&] { return bench.report().rest[0] == rest; }, 1000)) << describe(bench.report());
    return static_cast<int>((bench.now_ns - begun_ns) / kMs);
  }

  void send_foreign_write(std::uint16_t index, std::uint32_t value) {
    can::Frame frame{0x601, 8, {0x23}};
    stepper::cia301::put_u16(frame, 1, index);
    stepper::cia301::put_u32(frame, 4, value);
    bench.wire.inject(frame);
  }

  Bench bench;
};

TEST_F(MeasuredStop, IsMeasuredAtRest) {
  move();
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  EXPECT_EQ(bench.report().rest[0], AxisRest::slowing);
  EXPECT_LE(ms_until(AxisRest::at_rest), 100);
  EXPECT_NEAR(bench.insertion.velocity_unit_s(), 0.0, 0.05);
  EXPECT_EQ(bench.report().counters.stops_escalated, 0U);
  EXPECT_EQ(describe(bench.report()), "stopped by the operator");
}

// 0x6085 = 1: a stop by the quick-stop ramp would take 20000 s.
TEST_F(MeasuredStop, DisablesTheVoltageWhereTheQuickStopDoesNotSlow) {
  for (const double rate_mm_s : {20.0, 10.0, 2.0, 0.5}) {
    SCOPED_TRACE(rate_mm_s);
    Bench each;
    ASSERT_TRUE(each.enable());
    each.move(rate_mm_s, 0.0);
    each.run_ms(400);
    each.insertion.corrupt(0x6085, 0, 1);
    each.driver->stop_now(StopReason::operator_stop, each.now_ns);
    const auto ms = each.ms_to_rest();
    ASSERT_TRUE(ms.has_value());
    EXPECT_LE(*ms, 150);
    std::printf("%.1f mm/s: at rest %d ms after a stop whose ramp is missing\n", rate_mm_s, *ms);
    each.run_ms(100);
    EXPECT_EQ(each.report().state, DriverState::fault);
    EXPECT_EQ(each.report().order[0], StopOrder::disable_voltage);
    EXPECT_EQ(each.report().rest[0], AxisRest::at_rest);
    EXPECT_THAT(describe(each.report()), testing::StartsWith("insertion DID NOT SLOW by its quick stop"));
    EXPECT_THAT(describe(each.report()), HasSubstr("stopped by the operator"));
  }
}

TEST_F(MeasuredStop, DeclaresAnAxisThatNothingStops) {
  move();
  bench.insertion.set_power_stage_stuck(true);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  const int ms = ms_until(AxisRest::does_not_stop);
  std::printf("declared %d ms after the stop\n", ms);
  EXPECT_LE(ms, 100);
  EXPECT_THAT(describe(bench.report()), testing::StartsWith("insertion DOES NOT STOP: switch the drive's power off"));
  bench.run_ms(300);
  EXPECT_EQ(bench.report().order[0], StopOrder::nmt_stop);
  EXPECT_EQ(bench.insertion.nmt_state(), rig::NmtState::stopped);
  EXPECT_EQ(bench.report().state, DriverState::fault);
  EXPECT_EQ(bench.rotation.velocity_unit_s(), 0.0);
  EXPECT_THAT(describe(bench.report()), testing::StartsWith("insertion DOES NOT STOP"));
}

TEST_F(MeasuredStop, DeclaresAnAxisThatMovesAgain) {
  move();
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  EXPECT_LE(ms_until(AxisRest::at_rest), 100);
  bench.run_ms(500);
  const double rested_mm = bench.insertion.position_unit();
  bench.wire.set_tap([&](can::Frame& frame) {  // its encoder reports motion, its power stage is on
    if (frame.id == 0x281)
      stepper::cia301::put_u32(
          frame, 0,
          stepper::cia301::get_u32(frame, 0) +
              static_cast<std::uint32_t>(2000.0 * 1e-9 * static_cast<double>(bench.now_ns % 1'000'000'000)));
    return true;
  });
  EXPECT_TRUE(bench.run_until([&] { return bench.report().order[0] > StopOrder::quick_stop; }, 1000));
  EXPECT_NEAR(bench.insertion.position_unit(), rested_mm, 1e-6);
}

TEST_F(MeasuredStop, EscalatesForBothAxes) {
  move();
  bench.insertion.set_power_stage_stuck(true);
  bench.rotation.set_power_stage_stuck(true);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(400);
  EXPECT_EQ(bench.insertion.nmt_state(), rig::NmtState::stopped);
  EXPECT_EQ(bench.rotation.nmt_state(), rig::NmtState::stopped);
}

// A slow motion after rest: the second order does not wait for what a fast axis would be allowed.
TEST_F(MeasuredStop, EscalatesSoonForASlowMotionAfterRest) {
  move(20.0, 0.0);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(500);
  const std::int64_t begun_ns = bench.now_ns;
  bench.wire.set_tap([&](can::Frame& frame) {  // 1 mm/s, whatever it is ordered
    const double crept_mm = 1e-9 * static_cast<double>(bench.now_ns - begun_ns);
    if (frame.id == 0x281)
      stepper::cia301::put_u32(frame, 0,
                               stepper::cia301::get_u32(frame, 0) + static_cast<std::uint32_t>(2000.0 * crept_mm));
    return true;
  });
  EXPECT_TRUE(bench.run_until([&] { return bench.report().order[0] == StopOrder::nmt_stop; }, 400))
      << describe(bench.report());
}

TEST_F(MeasuredStop, StaysMeasuredWhenTheEntryIsSet) {
  move();
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(500);
  bench.driver->set_zero();
  bench.run_ms(500);
  EXPECT_EQ(bench.report().rest[0], AxisRest::at_rest);
  EXPECT_EQ(bench.report().counters.stops_escalated, 0U);
}

// The axis is still stationary when the stop is commanded, and moves a little before the stop has an effect.
TEST_F(MeasuredStop, OfAnAxisThatHasJustStartedIsNoFault) {
  for (int ms = 1; ms <= 40; ++ms) {
    Bench each;
    ASSERT_TRUE(each.enable());
    each.move(20.0, 10.0);
    each.run_ms(ms);
    each.driver->stop_now(StopReason::operator_stop, each.now_ns);
    each.run_ms(300);
    EXPECT_EQ(each.report().counters.stops_escalated, 0U) << ms << " ms: " << describe(each.report());
    EXPECT_EQ(each.report().rest[0], AxisRest::at_rest) << ms << " ms: " << describe(each.report());
    EXPECT_EQ(each.insertion.state(), rig::PowerStateMachine::State::quick_stop_active)
        << ms << " ms: held, not let go";
  }
}

// An operator may move the axis by hand once the drive no longer holds it.
TEST_F(MeasuredStop, AllowsAnAxisWithoutVoltageToBeMoved) {
  stepper::StepperConfig config;
  config.quick_stop_option = 2;
  Bench each(config);
  ASSERT_TRUE(each.enable());
  each.move(10.0, 0.0);
  each.run_ms(400);
  each.driver->stop_now(StopReason::operator_stop, each.now_ns);
  each.run_ms(500);
  each.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x281) stepper::cia301::put_u32(frame, 0, stepper::cia301::get_u32(frame, 0) - 4000U);
    return true;
  });
  each.run_ms(500);
  EXPECT_EQ(each.report().rest[0], AxisRest::at_rest);
  EXPECT_EQ(each.report().counters.stops_escalated, 0U);
}

TEST_F(MeasuredStop, OfADisabledAxisIsMeasuredToo) {
  move();
  bench.insertion.corrupt(0x6084, 0, 1);
  bench.wire.set_tap([](can::Frame& frame) {  // a drive that stays "switched on" and never lets go
    if (frame.id == 0x201 && frame.data[0] == 0x06) frame.data[0] = 0x07;
    return true;
  });
  bench.driver->disable();
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 400);
  EXPECT_EQ(bench.reason(), StopReason::does_not_stop);
}

TEST_F(MeasuredStop, HoldsForAForeignWriteOfTheRamp) {
  move();
  send_foreign_write(0x6085, 1);
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 150);
  bench.run_ms(100);
  EXPECT_EQ(bench.reason(), StopReason::foreign_master);
  EXPECT_THAT(describe(bench.report()), testing::StartsWith("insertion DID NOT SLOW"));
}

// Every setting that is monitored, changed without a frame: a fault that names it.
TEST_F(MeasuredStop, FindsEachSettingThatChanges) {
  struct Changed {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t value;
  };
  for (const Changed& each :
       {Changed{0x6085, 0, 1}, Changed{0x6084, 0, 1}, Changed{0x6083, 0, 1}, Changed{0x607F, 0, 1},
        Changed{0x605A, 0, 0}, Changed{0x6007, 0, 0}, Changed{0x1016, 1, 0}, Changed{0x1017, 0, 60},
        Changed{0x605E, 0, 0}, Changed{0x1029, 1, 1}, Changed{0x6096, 1, 2}, Changed{0x1800, 2, 255},
        Changed{0x1A01, 1, 0x60640020}}) {
    Bench world;
    ASSERT_TRUE(world.enable());
    world.run_ms(100);
    const bool harmless = world.insertion.objects().get(each.index, each.sub) == each.value;
    world.insertion.corrupt(each.index, each.sub, each.value);
    const bool stops = world.run_until([&] { return world.report().state >= DriverState::stopped; }, 2500);
    EXPECT_EQ(stops, !harmless) << std::hex << each.index;
    if (harmless || world.reason() != StopReason::setting_changed) continue;  // its effect may show sooner
    EXPECT_EQ(world.report().stop.object, (stepper::cia301::ObjectAddress{each.index, each.sub}));
    EXPECT_EQ(world.report().stop.code, each.value);
  }
}

TEST_F(MeasuredStop, ReportsADriveThatIsLostAfterwards) {
  move();
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(500);
  bench.insertion.set_silent(true);
  bench.run_ms(300);
  EXPECT_EQ(bench.reason(), StopReason::operator_stop) << "the first reason stays";
  EXPECT_EQ(bench.report().later.reason, StopReason::drive_heartbeat_lost);
  EXPECT_THAT(describe(bench.report()),
              HasSubstr("stopped by the operator; since then insertion: drive's heartbeat lost"));
}

TEST_F(MeasuredStop, IsNotMeasuredOfALostDrive) {
  move();
  bench.insertion.set_silent(true);
  bench.run_ms(400);
  EXPECT_EQ(bench.report().rest[0], AxisRest::not_measured);
  EXPECT_EQ(bench.report().rest[1], AxisRest::at_rest);
  EXPECT_THAT(describe(bench.report()), HasSubstr("insertion: rest not measured"));
}

}  // namespace
}  // namespace bevel::test
