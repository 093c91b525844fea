// SPDX-License-Identifier: MIT
// Profile velocity and cyclic synchronous velocity, and what the drives themselves supervise: the same insertion in
// both.
#include <gmock/gmock.h>

#include <limits>

#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using stepper::VelocityMode;

stepper::StepperConfig in_mode(VelocityMode mode) {
  stepper::StepperConfig config;
  config.mode = mode;
  return config;
}

class Mode : public testing::TestWithParam<VelocityMode> {
 protected:
  Bench bench{in_mode(GetParam())};
};

TEST_P(Mode, AxesFollowAndStop) {
  ASSERT_TRUE(bench.enable()) << describe(bench.report().stop);
  for (auto* drive : {&bench.insertion, &bench.rotation})
    EXPECT_EQ(drive->objects().get(0x6061), static_cast<std::uint32_t>(GetParam()));
  bench.move(5.0, -2.0);
  bench.run_ms(1000);
  EXPECT_EQ(bench.report().state, DriverState::enabled) << describe(bench.report().stop);
  EXPECT_NEAR(bench.report().insertion_rate_mm_s, 5.0, 0.005);
  EXPECT_NEAR(bench.report().rotation_rate_rad_s, -2.0, 0.002);
  EXPECT_NEAR(bench.report().insertion_mm, 5.0, 0.3);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 60);  // 10 ms at 500 mm/s^2, 10 ms at 200 rad/s^2, and the shafts' lag
  EXPECT_EQ(bench.insertion.state(), rig::PowerStateMachine::State::quick_stop_active);
}

TEST_P(Mode, AKilledDriver) {
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(400);
  bench.driver_runs = false;
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 200);
}

// A stop that is not due at a SYNC does not wait for the next one.
TEST_P(Mode, AStopBetweenTwoCyclesActsAtOnce) {
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  bench.run_ms(400);
  while (bench.now_ns / kMs % 10 != 3) bench.run_ms(1);
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(2);
  EXPECT_EQ(bench.insertion.state(), rig::PowerStateMachine::State::quick_stop_active);
  EXPECT_EQ(bench.rotation.state(), rig::PowerStateMachine::State::quick_stop_active);
}

TEST_P(Mode, AnotherModeOfTheDriveIsAFault) {
  ASSERT_TRUE(bench.enable());
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x281) frame.data[4] = 1;
    return true;
  });
  bench.run_ms(50);
  EXPECT_EQ(bench.reason(), StopReason::wrong_mode);
  EXPECT_EQ(bench.report().state, DriverState::fault);
}

INSTANTIATE_TEST_SUITE_P(Velocity, Mode, testing::Values(VelocityMode::profile, VelocityMode::cyclic),
                         [](const auto& mode) { return mode.param == VelocityMode::profile ? "pv" : "csv"; });

// A set-point that arrives between two cycles.
TEST(ASetpointTaken, IsOnTheBusAtOnceAndWithinTheLimits) {
  Bench bench;
  ASSERT_TRUE(bench.enable());
  std::int32_t commanded = 0;
  int commands = 0;
  bench.wire.set_tap([&](can::Frame& frame) {
    if (frame.id == 0x201) {
      commanded = static_cast<std::int32_t>(stepper::cia301::get_u32(frame, 2));
      ++commands;
    }
    return true;
  });
  while (bench.now_ns / kMs % 10 != 4) bench.run_ms(1);
  commands = 0;
  bench.move(10.0, 0.0);
  bench.driver->take(bench.now_ns, *bench.command);
  EXPECT_EQ(commands, 1);
  EXPECT_EQ(commanded, 1600) << "4 ms at 200 mm/s^2, 2000 counts a mm";
  // However often they arrive, no more than the acceleration.
  double steepest = 0, before = bench.insertion.velocity_unit_s();
  bench.each_ms = [&] {
    bench.driver->take(bench.now_ns, *bench.command);
    steepest = std::max(steepest, (bench.insertion.velocity_unit_s() - before) / 1e-3);
    before = bench.insertion.velocity_unit_s();
  };
  bench.run_ms(300);
  EXPECT_LE(steepest, 1.01 * bench.config.axes[0].acceleration_unit_s2);
  EXPECT_NEAR(bench.report().insertion_rate_mm_s, 10.0, 0.02);
  bench.run_ms(1000);
  EXPECT_EQ(bench.report().state, DriverState::enabled) << describe(bench.report().stop);
}

TEST(ASetpointTaken, IsRefusedStaleOrNotFiniteAndMovesNothingThatIsNotEnabled) {
  Bench bench;
  ASSERT_TRUE(bench.reach(DriverState::ready));
  bench.driver->take(bench.now_ns, {0, true, 10.0, 0.0});
  bench.run_ms(50);
  EXPECT_TRUE(bench.at_rest());
  ASSERT_TRUE(bench.enable());
  bench.driver->take(bench.now_ns, {0, true, std::numeric_limits<double>::quiet_NaN(), 0.0});
  EXPECT_GT(bench.report().counters.setpoints_refused, 0U);
  bench.driver->take(bench.now_ns, {90 * kMs, true, 10.0, 0.0});
  bench.run_ms(5);
  EXPECT_TRUE(bench.at_rest()) << "as old as one whose rate is zero";
}

TEST(ASetpointTaken, WaitsForTheSyncInCyclicVelocity) {
  Bench bench(in_mode(VelocityMode::cyclic));
  ASSERT_TRUE(bench.enable());
  int commands = 0;
  bench.wire.set_tap([&commands](can::Frame& frame) {
    commands += frame.id == 0x201 ? 1 : 0;
    return true;
  });
  bench.driver->take(bench.now_ns, {0, true, 10.0, 0.0});
  EXPECT_EQ(commands, 0);
}

// A bus on which the command before is not on the wire yet: the newest goes out when its echo comes.
class BetweenCycles : public testing::Test {
 protected:
  BetweenCycles() {
    bench_.wire.set_tap([this](can::Frame& frame) {
      if (frame.id == 0x201) sent_.push_back(static_cast<std::int32_t>(stepper::cia301::get_u32(frame, 2)));
      if (frame.id == 0x202) words_.push_back(stepper::cia301::get_u16(frame, 0));
      return true;
    });
  }
  void take(double rate_mm_s) { bench_.driver->take(bench_.now_ns, {0, true, rate_mm_s, 0.0}); }
  Bench bench_;
  std::vector<std::int32_t> sent_;    // to the insertion axis, counts/s
  std::vector<std::uint16_t> words_;  // to the rotation axis
};

TEST_F(BetweenCycles, ACommandThatIsHeldBackGoesOutWithTheEchoOfTheOneBefore) {
  ASSERT_TRUE(bench_.enable());
  bench_.move(5.0, 0.0);
  bench_.run_ms(200);
  EXPECT_FALSE(bench_.driver->command_waits());
  sent_.clear();
  bench_.wire.set_acknowledged(false);
  take(5.001);
  EXPECT_FALSE(bench_.driver->command_waits()) << "the first one is under way";
  take(5.002);
  take(5.003);
  EXPECT_TRUE(bench_.driver->command_waits());
  bench_.driver->receive(bench_.now_ns);
  EXPECT_TRUE(bench_.driver->command_waits()) << "no echo yet";
  bench_.wire.set_acknowledged(true);
  bench_.driver->receive(bench_.now_ns);
  EXPECT_FALSE(bench_.driver->command_waits());
  bench_.driver->receive(bench_.now_ns);
  // Of three at one instant: the first, and the newest of the others, none twice. No time has passed for another rate.
  ASSERT_EQ(sent_.size(), 2U);
  EXPECT_EQ(sent_[0], sent_[1]);
  bench_.run_ms(4);
  take(5.003);
  EXPECT_EQ(sent_.back(), 10'006);
}

TEST_F(BetweenCycles, AStopThatIsHeldBackGoesOutWithTheEcho) {
  ASSERT_TRUE(bench_.enable());
  bench_.move(5.0, 1.0);
  bench_.run_ms(200);
  bench_.wire.set_acknowledged(false);
  take(5.0);
  words_.clear();
  bench_.driver->stop_now(StopReason::operator_stop, bench_.now_ns);
  EXPECT_TRUE(bench_.driver->command_waits());
  bench_.wire.set_acknowledged(true);
  bench_.driver->receive(bench_.now_ns);
  ASSERT_EQ(words_.size(), 2U);
  EXPECT_EQ(words_[1], stepper::cia402::controlword::kQuickStop);
}

TEST_F(BetweenCycles, AnEmergencyStopsBothAxesAtOnce) {
  ASSERT_TRUE(bench_.enable());
  bench_.move(5.0, 1.0);
  bench_.run_ms(200);
  bench_.driver_runs = false;
  words_.clear();
  bench_.wire.inject({0x081, 8, {0x10, 0x23, 0x01}});
  bench_.driver->receive(bench_.now_ns);
  EXPECT_EQ(bench_.reason(), StopReason::drive_emergency);
  ASSERT_EQ(words_.size(), 1U);
  EXPECT_EQ(words_[0], stepper::cia402::controlword::kQuickStop);
}

TEST(CyclicMode, BothAxesActAtOneSync) {
  Bench bench(in_mode(VelocityMode::cyclic));
  ASSERT_TRUE(bench.enable());
  // The rotation's command is late, but still before the SYNC of the next cycle: both begin with that one.
  bench.wire.set_tap([](can::Frame& frame) { return frame.id != 0x080; });
  bench.move(5.0, 2.0);
  bench.run_ms(30);
  EXPECT_TRUE(bench.at_rest()) << "commands without a SYNC move nothing";
  bench.wire.set_tap(nullptr);
  bench.run_until([&] { return !bench.at_rest(); }, 30);
  EXPECT_GT(bench.insertion.velocity_unit_s(), 0.0);
  EXPECT_GT(bench.rotation.velocity_unit_s(), 0.0);
}

TEST(CyclicMode, APeriodThatTheDriveCannotBeToldIsRefused) {
  auto config = in_mode(VelocityMode::cyclic);
  config.period_ns = 7'500'000;
  EXPECT_THAT(stepper::problems_of(config), testing::ElementsAre(testing::HasSubstr("period_ms = 7.5")));
}

TEST(DriveSupervision, ALimitSwitchIsALatchedStopAndIsLeftAgain) {
  Bench bench({}, {-5.0 * 2000.0, 5.0 * 2000.0});
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 3.0);
  ASSERT_TRUE(bench.run_until([&] { return bench.insertion.position_unit() >= 5.0; }, 2000));
  const auto ms = bench.ms_to_rest();
  ASSERT_TRUE(ms.has_value());
  EXPECT_LE(*ms, 100);
  bench.run_ms(100);
  EXPECT_EQ(bench.reason(), StopReason::upper_switch);
  EXPECT_EQ(bench.report().stop.axis, 0);
  EXPECT_EQ(bench.report().state, DriverState::stopped);
  // Enabled again, it may go back, and not on.
  bench.command = stepper::MotionSetpoint{};
  ASSERT_TRUE(bench.driver->rearm());
  ASSERT_TRUE(bench.enable());
  const double stands_mm = bench.insertion.position_unit();
  bench.move(10.0, 0.0);
  bench.run_ms(300);
  EXPECT_NEAR(bench.insertion.position_unit(), stands_mm, 0.01);
  EXPECT_EQ(bench.reason(), StopReason::upper_switch) << "asked anew";
  bench.command = stepper::MotionSetpoint{};
  ASSERT_TRUE(bench.driver->rearm());
  ASSERT_TRUE(bench.enable());
  bench.move(-5.0, 0.0);
  bench.run_ms(500);
  EXPECT_LT(bench.insertion.position_unit(), 4.0);
  EXPECT_EQ(bench.report().state, DriverState::enabled) << describe(bench.report().stop);
}

// Which one it was the drive says (0x60FD); the axis may count the other way round than the drive.
TEST(DriveSupervision, WhichLimitItWas) {
  struct Case {
    double counts_per_mm, rate_mm_s;
    StopReason wanted;
  };
  for (const auto& [counts_per_mm, rate_mm_s, wanted] :
       {Case{2000, 10, StopReason::upper_switch}, Case{2000, -10, StopReason::lower_switch},
        Case{-2000, 10, StopReason::upper_switch}, Case{-2000, -10, StopReason::lower_switch}}) {
    stepper::StepperConfig config;
    config.axes[0].counts_per_unit = counts_per_mm;
    Bench bench(config, {-5.0 * 2000.0, 5.0 * 2000.0});
    ASSERT_TRUE(bench.enable());
    bench.move(rate_mm_s, 0.0);
    ASSERT_TRUE(bench.run_until([&] { return bench.reason() == StopReason::travel_limit; }, 1000));
    EXPECT_TRUE(bench.run_until([&, reason = wanted] { return bench.reason() == reason; }, 50))
        << describe(bench.report().stop);
  }
}

TEST(DriveSupervision, ADriveWithoutInputsLeavesOpenWhichLimitItWas) {
  Bench bench({}, {-5.0 * 2000.0, 5.0 * 2000.0});
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x581 && frame.data[1] == 0xFD && frame.data[2] == 0x60) {
      frame.data[0] = 0x80;
      stepper::cia301::put_u32(frame, 4, 0x06020000);
    }
    return true;
  });
  ASSERT_TRUE(bench.enable());
  bench.move(10.0, 0.0);
  ASSERT_TRUE(bench.run_until([&] { return bench.reason() == StopReason::travel_limit; }, 1000));
  bench.run_ms(1000);
  EXPECT_EQ(bench.reason(), StopReason::travel_limit);
  EXPECT_EQ(bench.report().counters.sdo_ignored, 0U);
}

TEST(DriveSupervision, FollowingErrorWindowReachesTheDrive) {
  stepper::StepperConfig config;
  config.axes[0].following_error_unit = 0.2;
  config.following_error_ns = 10 * kMs;
  Bench bench(config);
  ASSERT_TRUE(bench.enable());
  EXPECT_EQ(bench.insertion.objects().get(0x6065), 400U);
  EXPECT_EQ(bench.insertion.objects().get(0x6066), 10U);
  EXPECT_EQ(bench.rotation.objects().get(0x6065), 2000U) << "left as the drive has it";
  bench.move(10.0, 0.0);
  bench.run_ms(400);
  bench.insertion.set_motor_blocked(true);
  EXPECT_TRUE(bench.ms_to_rest().has_value());
  bench.run_ms(100);
  EXPECT_EQ(bench.report().stop.code, 0x8611U) << "the drive's own watch, narrower than the driver's";
}

// A drive that insists on another velocity unit would run at another speed than it is told.
TEST(DriveSupervision, AVelocityFactorThatStaysIsRefused) {
  Bench bench;
  bench.wire.set_tap([](can::Frame& frame) {
    const bool factor = frame.data[1] == 0x96 && frame.data[2] == 0x60 && frame.data[3] == 1;
    if (frame.id == 0x581 && frame.data[0] == 0x43 && factor) frame.data[4] = 60;
    return true;
  });
  ASSERT_TRUE(bench.reach(DriverState::fault));
  EXPECT_EQ(bench.reason(), StopReason::unit_unsupported);
  EXPECT_EQ(bench.report().stop.object, (stepper::cia301::ObjectAddress{0x6096, 1}));
  EXPECT_EQ(bench.report().stop.code, 60U);
}

}  // namespace
}  // namespace bevel::test
