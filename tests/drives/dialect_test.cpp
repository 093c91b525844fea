// SPDX-License-Identifier: MIT
// Drives as makers ship them, by the simulated drive's dialects: right, or refused before the power stage is enabled.
#include <gmock/gmock.h>

#include <bevel/drivers/stepper/drive_units.hpp>
#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using stepper::StepperConfig;
using stepper::VelocityUnit;
using testing::HasSubstr;
using Object = stepper::cia301::ObjectAddress;

constexpr double kCountsPerRevolution = 51200.0;  // of the simulated drive, 0x6092

rig::DriveDialect rpm(VelocityUnit unit = VelocityUnit::rpm, bool states_unit = true) {
  rig::DriveDialect dialect;
  dialect.velocity_unit = static_cast<std::uint32_t>(unit);
  dialect.states_unit = states_unit;
  return dialect;
}

StepperConfig with_revolution(double counts, VelocityUnit unit = VelocityUnit::as_stated) {
  StepperConfig config;
  config.axes[0].counts_per_revolution = counts;
  config.axes[0].velocity_unit = unit;
  return config;
}

void expect_refused(const StepperConfig& config, const rig::DriveDialect& dialect, StopReason reason, Object object,
                    const char* remedy) {
  Bench bench(config, {}, dialect);
  bool enabled = false;
  bench.each_ms = [&] {
    enabled = enabled || bench.insertion.state() == rig::PowerStateMachine::State::operation_enabled;
  };
  ASSERT_TRUE(bench.reach(DriverState::fault)) << describe(bench.report());
  EXPECT_EQ(bench.reason(), reason) << describe(bench.report());
  EXPECT_EQ(bench.report().stop.object, object);
  EXPECT_THAT(describe(bench.report()), HasSubstr(remedy));
  EXPECT_FALSE(enabled);
}

TEST(VelocityUnits, RpmIsRefusedWithoutTheResolution) {
  expect_refused({}, rpm(), StopReason::unit_needs_revolution, {0x60A9, 0}, "set counts_per_revolution");
}

TEST(VelocityUnits, AreUnknownIfNothingStatesThem) {
  expect_refused({}, rpm(VelocityUnit::rpm, false), StopReason::unit_unstated, {0x60A9, 0}, "set velocity_unit");
}

TEST(VelocityUnits, ThatContradictTheConfigurationAreRefused) {
  expect_refused(with_revolution(4096.0), rpm(), StopReason::unit_contradicts, {0x6092, 1}, "counts_per_revolution");
  expect_refused(with_revolution(0.0, VelocityUnit::counts_per_s), rpm(), StopReason::unit_contradicts, {0x60A9, 0},
                 "velocity_unit");
}

TEST(VelocityUnits, AreCountsPerSecondByTheFactor) {
  expect_refused(with_revolution(51200.0, VelocityUnit::rpm), {}, StopReason::unit_contradicts, {0x6096, 1},
                 "velocity_unit");
  EXPECT_TRUE(Bench(with_revolution(0.0, VelocityUnit::counts_per_s)).enable());
}

// The mean rate is right to 1 % where one unit is 0.43 mm/s, also below it, and so is the stop.
TEST(VelocityUnits, InRpmAreConverted) {
  struct Case {
    VelocityUnit drive, configured;
    bool stated;
  };
  for (const Case& each : {Case{VelocityUnit::rpm, VelocityUnit::as_stated, true},
                           Case{VelocityUnit::thousandth_rpm, VelocityUnit::as_stated, true},
                           Case{VelocityUnit::tenth_rpm, VelocityUnit::tenth_rpm, false}}) {
    for (const double rate_mm_s : {0.2, 1.0, 10.0, -3.0}) {
      SCOPED_TRACE(rate_mm_s);
      Bench bench(with_revolution(kCountsPerRevolution, each.configured), {}, rpm(each.drive, each.stated));
      ASSERT_TRUE(bench.enable()) << describe(bench.report());
      bench.move(rate_mm_s, 0.0);
      bench.run_ms(500);
      const double before_mm = bench.insertion.position_unit();
      bench.run_ms(4000);
      EXPECT_NEAR((bench.insertion.position_unit() - before_mm) / 4.0, rate_mm_s, 0.01 * std::abs(rate_mm_s))
          << describe(bench.report());
      EXPECT_NEAR(bench.report().insertion_rate_mm_s, rate_mm_s, 0.5);
      bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
      EXPECT_LE(bench.ms_to_rest().value_or(1000), 100);
      bench.run_ms(200);
      EXPECT_EQ(bench.report().rest[0], stepper::AxisRest::at_rest) << describe(bench.report());
      EXPECT_EQ(bench.report().counters.stops_escalated, 0U);
    }
  }
}

// A unit that changes in motion: noticed within 20 ms of the first report, at any speed.
TEST(VelocityUnits, ThatAreWrongInMotionAreNoticed) {
  for (const double rate_mm_s : {0.2, 1.0, 10.0}) {
    SCOPED_TRACE(rate_mm_s);
    Bench bench;
    ASSERT_TRUE(bench.enable());
    bench.insertion.corrupt(0x6096, 2, 20);  // 20 times as fast, and so are its ramps
    const double before_mm = bench.insertion.position_unit();
    bench.move(rate_mm_s, 0.0);
    ASSERT_TRUE(bench.run_until([&] { return bench.report().state >= DriverState::stopped; }, 200));
    EXPECT_THAT(bench.reason(), testing::AnyOf(StopReason::too_fast, StopReason::not_following));
    (void)bench.ms_to_rest();
    EXPECT_LE(bench.insertion.position_unit() - before_mm, 20 * rate_mm_s * 0.04 + 0.1);
  }
}

// Independent check of the conversion, by the definition of each unit.
TEST(VelocityUnits, FollowFromTheObjects) {
  stepper::AxisConfig axis;
  const auto scale = [&](std::uint32_t position, std::uint32_t velocity, std::uint32_t acceleration = 0) {
    stepper::StatedUnits stated;
    stated.position_unit = position;
    stated.velocity_unit = velocity;
    stated.acceleration_unit = acceleration;
    const auto decision = stepper::scales_of(stated, axis);
    EXPECT_EQ(decision.refusal, StopReason::none);
    return decision.scales;
  };
  // Nanotec as shipped: positions in 0.1 degree, velocities in rpm. 3600 counts/s are 60 rpm.
  EXPECT_NEAR(3600 * scale(0xFF410000, 0x00B44700).velocity_per_count_s, 60.0, 1e-9);
  EXPECT_NEAR(scale(0x00B50000, 0x00B50300).velocity_per_count_s, 1.0, 1e-12);   // increments, increments/s
  EXPECT_NEAR(scale(0x00000000, 0xFDB50300).velocity_per_count_s, 1e3, 1e-9);    // thousandths of increments/s
  EXPECT_NEAR(scale(0xFA010000, 0xFD010300).velocity_per_count_s, 1e-3, 1e-15);  // micrometres, mm/s
  axis.counts_per_revolution = 4096;
  EXPECT_NEAR(4096 * scale(0, 0x00B44700).velocity_per_count_s, 60.0, 1e-9);
  EXPECT_NEAR(4096 * scale(0, 0x00B44700).acceleration_per_count_s2, 60.0, 1e-9);              // rpm/s
  EXPECT_NEAR(4096 * scale(0, 0x00B44700, 0x00B45700).acceleration_per_count_s2, 1.0, 1e-12);  // rev/s^2
}

TEST(SlowBoot, IsAwaitedAfterOneReset) {
  for (const double boot_s : {0.1, 0.7, 1.5, 4.5}) {
    SCOPED_TRACE(boot_s);
    rig::DriveDialect dialect;
    dialect.boot_s = boot_s;
    Bench bench({}, {}, dialect);
    int resets = 0;
    bench.wire.set_tap([&](can::Frame& frame) {
      resets += frame.id == 0 && frame.data[0] == 0x82 && frame.data[1] == 1;
      return true;
    });
    ASSERT_TRUE(bench.run_until([&] { return bench.report().waits_for_boot[0]; }, 1000));
    EXPECT_THAT(describe(bench.report()), HasSubstr("insertion: reset sent, waiting for boot-up"));
    ASSERT_TRUE(bench.reach(DriverState::ready, 10000)) << describe(bench.report());
    EXPECT_LE(resets, 2) << "one, and one of a boot that it was still in when the driver began";
  }
}

TEST(SlowBoot, ALostResetIsSentAgain) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(200);
  int lost = 0;
  bench.wire.set_tap([&](can::Frame& frame) { return frame.id != 0 || frame.data[0] != 0x82 || ++lost > 2; });
  ASSERT_TRUE(bench.driver->rearm());
  EXPECT_TRUE(bench.reach(DriverState::ready, 3000)) << "its heartbeat shows that it was not reset";
}

TEST(CobIds, AreSetWithBit30WhereTheDriveTakesIt) {
  rig::DriveDialect needs, rejects;
  needs.needs_bit_30 = true;
  rejects.rejects_bit_30 = true;
  for (const auto& [dialect, cob_id] : {std::pair{needs, 0x40000181U}, std::pair{rejects, 0x181U}}) {
    Bench bench({}, {}, dialect);
    ASSERT_TRUE(bench.enable()) << describe(bench.report());
    EXPECT_EQ(bench.insertion.objects().get(0x1800, 1), cob_id);
    EXPECT_EQ(bench.insertion.objects().get(0x1400, 1), 0x201U) << "an RPDO's bit 30 is reserved";
    bench.move(10.0, 0.0);
    bench.run_ms(400);
    EXPECT_NEAR(bench.insertion.velocity_unit_s(), 10.0, 0.1);
  }
}

TEST(Modes, MayBeShownOnlyWhileEnabled) {
  rig::DriveDialect dialect;
  dialect.shows_mode_only_enabled = true;
  Bench bench({}, {}, dialect);
  ASSERT_TRUE(bench.enable()) << describe(bench.report());
  bench.move(10.0, 0.0);
  bench.run_ms(400);
  EXPECT_NEAR(bench.insertion.velocity_unit_s(), 10.0, 0.1);
  bench.driver->disable();
  bench.run_ms(500);
  EXPECT_EQ(bench.report().state, DriverState::ready);
}

TEST(OptionalObjects, AreOptional) {
  rig::DriveDialect lacks_modes;
  lacks_modes.lacks = {{0x6502, 0}};
  EXPECT_TRUE(Bench({}, {}, lacks_modes).enable());
  for (const std::uint16_t index : {0x6007, 0x605A, 0x605E, 0x607F, 0x6083, 0x6084, 0x6085}) {
    rig::DriveDialect dialect;
    dialect.rejects = {{{index, 0}, rig::Abort::no_object}};
    Bench bench({}, {}, dialect);
    // Reads are aborted too: the simulated drive itself needs a value, which it hides.
    bench.wire.set_tap([index](can::Frame& frame) {
      const bool answer = frame.id == 0x581 && stepper::cia301::get_u16(frame, 1) == index;
      if (answer && frame.data[0] != 0x60) frame.data[0] = 0x80, stepper::cia301::put_u32(frame, 4, 0x06020000);
      return true;
    });
    EXPECT_TRUE(bench.enable()) << std::hex << index << ": " << describe(bench.report());
  }
}

// Each cause of a refusal reads differently: object, value, abort code with its text, remedy.
TEST(Refusals, NameObjectValueAbortAndRemedy) {
  struct Case {
    rig::ObjectDictionary::Key key;
    const char *object, *remedy;
  };
  for (const Case& each :
       {Case{{0x605A, 0}, "0x605A:00 = 6,", "quick_stop_option"},
        Case{{0x6085, 0}, "0x6085:00 = 1000000,", "quick_stop_unit_s2"},
        Case{{0x1A00, 1}, "0x1A00:01 = 0x60410010,", "PDO mapping"},
        Case{{0x6007, 0}, "0x6007:00 = 2,", "connection is lost"}, Case{{0x1016, 1}, "0x1016:01 = 0x7F0064,", "0x1016"},
        Case{{0x1017, 0}, "0x1017:00 = 0x1E,", "drive_heartbeat_ms"},
        Case{{0x6060, 0}, "0x6060:00 = 3,", "stepper.mode"}}) {
    rig::DriveDialect dialect;
    dialect.rejects = {{each.key, rig::Abort::value_range}};
    Bench bench({}, {}, dialect);
    ASSERT_TRUE(bench.reach(DriverState::fault)) << each.object;
    const std::string text = describe(bench.report());
    EXPECT_THAT(text, HasSubstr("insertion: drive rejected its configuration"));
    EXPECT_THAT(text, HasSubstr(each.object));
    EXPECT_THAT(text, HasSubstr("abort code 06090030h: value out of range"));
    EXPECT_THAT(text, HasSubstr(each.remedy));
  }
}

}  // namespace
}  // namespace bevel::test
