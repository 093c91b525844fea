// SPDX-License-Identifier: MIT
// The drives' software limits (0x607D): written from the configuration, moved with the entry, kept by the drive.
#include <gmock/gmock.h>

#include <limits>

#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using stepper::StepperConfig;
using stepper::VelocityMode;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::int32_t kNone_low = std::numeric_limits<std::int32_t>::min();
constexpr std::int32_t kNone_high = std::numeric_limits<std::int32_t>::max();

StepperConfig with_drive_limits(std::optional<double> min_mm, std::optional<double> max_mm) {
  StepperConfig config;
  config.axes[0].drive_position_min_unit = min_mm;
  config.axes[0].drive_position_max_unit = max_mm;
  return config;
}

StepperConfig with_workspace(double min_mm, double max_mm) {
  StepperConfig config;
  config.axes[0].position_min_unit = min_mm;
  config.axes[0].position_max_unit = max_mm;
  return config;
}

std::pair<std::int32_t, std::int32_t> limits_of(const rig::SimulatedDrive& drive) {
  return {drive.objects().get_signed(0x607D, 1), drive.objects().get_signed(0x607D, 2)};
}

bool stands_enabled(const Bench& bench) { return bench.report().state == DriverState::enabled; }

TEST(DriveLimits, AreWrittenInThePositionUnitsOfTheDrive) {
  StepperConfig config = with_drive_limits(-1.5, 4.0);
  config.axes[1].counts_per_unit = -1000.0;
  config.axes[1].drive_position_min_unit = -3.0;
  config.axes[1].drive_position_max_unit = 7.0;
  Bench bench(config);
  ASSERT_TRUE(bench.reach(DriverState::ready)) << describe(bench.report().stop);
  EXPECT_EQ(limits_of(bench.insertion), std::pair(-3000, 8000));
  EXPECT_EQ(limits_of(bench.rotation), std::pair(-7000, 3000)) << "turned over with the direction";
}

TEST(DriveLimits, OneIsEnoughAndWithoutAnyTheDriveKeepsItsOwn) {
  Bench one(with_drive_limits({}, 4.0));
  ASSERT_TRUE(one.reach(DriverState::ready));
  EXPECT_EQ(limits_of(one.insertion), std::pair(kNone_low, 8000));
  std::size_t written = 0;
  one.wire.set_tap([&written](can::Frame& frame) {
    written += frame.id == 0x601 && frame.data[1] == 0x7D && frame.data[2] == 0x60 ? 1 : 0;
    return true;
  });
  one.driver = std::make_unique<stepper::StepperDriver>(*one.driver_bus, StepperConfig{});
  ASSERT_TRUE(one.reach(DriverState::ready));
  EXPECT_EQ(written, 0U);
  EXPECT_EQ(limits_of(one.insertion), std::pair(kNone_low, 8000));
}

// Whether they move up or down, and by more than their distance: a drive refuses a lower limit that is not below the
// upper one.
TEST(DriveLimits, ReplaceWhateverTheDriveHad) {
  Bench bench(with_drive_limits(1.0, 2.0));
  ASSERT_TRUE(bench.reach(DriverState::ready));
  for (const auto& [min_mm, max_mm] : {std::pair(-2, -1), std::pair(10, 20)}) {
    bench.driver = std::make_unique<stepper::StepperDriver>(*bench.driver_bus, with_drive_limits(min_mm, max_mm));
    ASSERT_TRUE(bench.reach(DriverState::ready)) << describe(bench.report().stop);
    EXPECT_EQ(limits_of(bench.insertion), std::pair(2000 * min_mm, 2000 * max_mm));
  }
}

// By default a little beyond the workspace: what the axis goes at 20 mm/s in two cycles of 10 ms, and in a quick stop
// at 500 mm/s^2, is 0.8 mm.
TEST(DriveLimits, FollowFromTheWorkspace) {
  Bench bench(with_workspace(-1.0, 4.0));
  ASSERT_TRUE(bench.reach(DriverState::ready));
  EXPECT_EQ(limits_of(bench.insertion), std::pair(-3600, 9600));
  EXPECT_EQ(limits_of(bench.rotation), std::pair(kNone_low, kNone_high));
}

// The driver brakes for the workspace; the drive, whose own limits are beyond, has nothing to say.
TEST(DriveLimits, AreNotMetByAnAxisThatComesToTheEndOfItsWorkspace) {
  for (const auto mode : {VelocityMode::profile, VelocityMode::cyclic}) {
    for (const double rate_mm_s : {0.5, 5.0, 20.0}) {
      StepperConfig config = with_workspace(-0.5, 0.5);
      config.mode = mode;
      config.axes[0].rate_limit_unit_s = rate_mm_s;
      Bench bench(config);
      ASSERT_TRUE(bench.enable());
      for (const double direction : {1.0, -1.0}) {
        bench.move(direction * 20.0, 0.0);
        bench.run_ms(200 + static_cast<int>(1500 / rate_mm_s));
        EXPECT_NEAR(bench.insertion.position_unit(), direction * 0.5, 0.05) << rate_mm_s;
        EXPECT_TRUE(stands_enabled(bench)) << rate_mm_s << ": " << describe(bench.report().stop);
      }
    }
  }
}

TEST(DriveLimits, MoveWithTheEntryAndNothingIsEnabledBefore) {
  Bench bench(with_drive_limits(-2.0, 6.0));
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 0.0);
  bench.run_ms(400);
  bench.move(0.0, 0.0);
  bench.run_ms(300);
  bench.driver->disable();
  ASSERT_TRUE(bench.run_until([&] { return bench.at_rest(); }));
  bench.run_ms(300);
  ASSERT_EQ(bench.report().state, DriverState::ready) << describe(bench.report().stop);
  const auto entry_counts = static_cast<std::int32_t>(std::lround(2000.0 * bench.report().insertion_mm));
  ASSERT_GT(entry_counts, 4000);
  bench.driver->set_zero();
  EXPECT_EQ(bench.driver->enable(), stepper::EnableAnswer::not_ready) << "the drive has the limits of another entry";
  bench.run_ms(200);
  EXPECT_EQ(limits_of(bench.insertion), std::pair(entry_counts - 4000, entry_counts + 12'000));
  ASSERT_TRUE(bench.enable()) << describe(bench.report().stop);
  // They are still those of this entry when the drive has been configured anew.
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(200);
  ASSERT_TRUE(bench.driver->rearm());
  ASSERT_TRUE(bench.enable()) << describe(bench.report().stop);
  EXPECT_EQ(limits_of(bench.insertion), std::pair(entry_counts - 4000, entry_counts + 12'000));
}

TEST(DriveLimits, AnAxisHeldByItsDriveIsALatchedStopAndMayGoBack) {
  for (const auto mode : {VelocityMode::profile, VelocityMode::cyclic}) {
    StepperConfig config = with_drive_limits(-1.0, 4.0);
    config.mode = mode;
    Bench bench(config);
    ASSERT_TRUE(bench.enable());
    double furthest_mm = 0.0;
    bench.each_ms = [&] { furthest_mm = std::max(furthest_mm, bench.insertion.position_unit()); };
    bench.move(10.0, 3.0);
    ASSERT_TRUE(bench.run_until([&] { return bench.report().state == DriverState::stopped; }, 2000));
    ASSERT_TRUE(bench.ms_to_rest().has_value());
    bench.run_ms(50);
    EXPECT_EQ(bench.reason(), StopReason::drive_limit) << "and no switch";
    EXPECT_EQ(bench.report().stop.axis, 0);
    EXPECT_GT(furthest_mm, 3.5);
    bench.run_ms(500);
    EXPECT_EQ(bench.reason(), StopReason::drive_limit) << "latched";
    // Again towards it, as far as it goes, and back.
    bench.command = stepper::MotionSetpoint{};
    ASSERT_TRUE(bench.driver->rearm());
    ASSERT_TRUE(bench.enable());
    bench.move(10.0, 0.0);
    ASSERT_TRUE(bench.run_until([&] { return bench.reason() == StopReason::travel_limit; }, 1000));
    bench.run_ms(500);
    EXPECT_LE(furthest_mm, 4.001);
    bench.command = stepper::MotionSetpoint{};
    ASSERT_TRUE(bench.driver->rearm());
    ASSERT_TRUE(bench.enable());
    bench.move(-5.0, 0.0);
    bench.run_ms(400);
    EXPECT_LT(bench.insertion.position_unit(), 3.0);
    EXPECT_TRUE(stands_enabled(bench)) << describe(bench.report().stop);
  }
}

// A drive that takes a limit and keeps another one.
TEST(DriveLimits, OneThatTheDriveClipsIsRefused) {
  for (const bool asked_for : {true, false}) {
    Bench bench(asked_for ? with_drive_limits(-1.0, 4.0) : with_workspace(-1.0, 4.0));
    bench.wire.set_tap([](can::Frame& frame) {
      const bool upper = frame.data[1] == 0x7D && frame.data[2] == 0x60 && frame.data[3] == 2;
      if (frame.id == 0x581 && frame.data[0] == 0x43 && upper) stepper::cia301::put_u32(frame, 4, 7000);
      return true;
    });
    ASSERT_TRUE(bench.reach(DriverState::fault));
    EXPECT_EQ(bench.reason(), StopReason::configuration_failed);
    EXPECT_EQ(bench.report().stop.axis, 0);
    EXPECT_EQ(bench.report().stop.object, (stepper::cia301::ObjectAddress{0x607D, 2}));
    EXPECT_EQ(bench.report().stop.code, 7000U) << "the value found";
  }
}

// Without the object a drive cannot do what it is asked for; the workspace the driver keeps by itself.
TEST(DriveLimits, OfADriveThatHasNone) {
  for (const bool asked_for : {true, false}) {
    Bench bench(asked_for ? with_drive_limits(-1.0, 4.0) : with_workspace(-1.0, 4.0));
    bench.wire.set_tap([](can::Frame& frame) {
      const bool limits = frame.data[1] == 0x7D && frame.data[2] == 0x60;
      if (frame.id == 0x581 && limits) {
        frame.data[0] = 0x80;
        stepper::cia301::put_u32(frame, 4, 0x06020000);
      }
      return true;
    });
    ASSERT_TRUE(bench.reach(asked_for ? DriverState::fault : DriverState::ready));
    EXPECT_EQ(bench.reason(), asked_for ? StopReason::sdo_aborted : StopReason::none);
    EXPECT_EQ(bench.report().stop.code, asked_for ? 0x06020000U : 0U);
  }
}

TEST(DriveLimits, ProblemsNameKeyValueAndRange) {
  using testing::ElementsAre;
  using testing::HasSubstr;
  EXPECT_THAT(problems_of(with_drive_limits(4.0, 4.0)),
              ElementsAre(HasSubstr("insertion.drive_position_min_unit = 4: must be below drive_position_max_unit")));
  EXPECT_THAT(problems_of(with_drive_limits({}, kInfinite)),
              ElementsAre(HasSubstr("insertion.drive_position_max_unit = inf: must be finite")));
  EXPECT_THAT(
      problems_of(with_drive_limits(-1e6, {})),
      ElementsAre(HasSubstr("insertion.drive_position_min_unit = -1e+06: must be finite, and below 1e9 counts")));
}

}  // namespace
}  // namespace bevel::test
