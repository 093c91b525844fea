// SPDX-License-Identifier: MIT
// The simulated drive as a bench would judge one: what it reports of its motion, its units, its limits, its way of
// stopping.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tests/drives/bench.hpp"
#include "tests/drives/raw_drive.hpp"

namespace bevel::test {
namespace {

using State = rig::PowerStateMachine::State;
constexpr std::uint32_t kProfileVelocity = 3;
constexpr std::uint32_t kHoming = 6;
constexpr std::uint32_t kCyclicVelocity = 9;
constexpr std::uint32_t kOutOfRange = 0x06090030;

// A program that is put aside now and then steps the drive unevenly: 0.1 to 6 ms. What the drive reports must not show
// it.
TEST_F(RawDrive, VelocityActualIsThatOfTheDemandHoweverUnevenTheSteps) {
  enable(kProfileVelocity);
  ASSERT_EQ(set(0x60FF, 0, 4000, 4), 0U);
  run_ms(600);  // 400 ms of ramp
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> step_ns(100'000, 6'000'000);
  for (int i = 0; i < 500; ++i) {
    step(step_ns(random));
    ASSERT_NEAR(static_cast<std::int32_t>(drive->objects().get(0x606C)), 4000, 4) << "after step " << i;
  }
}

TEST_F(RawDrive, PositionDoesNotDependOnTheSteps) {
  const auto travel = [](std::int64_t step_ns) {
    rig::DriveMotion motion(0.004);
    for (std::int64_t t = 0; t < 300'000'000; t += step_ns)
      motion.step(static_cast<double>(step_ns) * 1e-9, t < 150'000'000 ? 4000.0 : -1000.0, 50'000.0);
    return motion.position();
  };
  EXPECT_NEAR(travel(1'000'000), travel(10'000'000), 1e-6);
}

TEST_F(RawDrive, TextsComeInSegments) {
  EXPECT_EQ(get_text(0x1008), "Bevel simulated stepper drive");
  EXPECT_EQ(get_text(0x1009), "simulated");
  EXPECT_EQ(get_text(0x100A), "2.0");  // three characters: expedited
  EXPECT_EQ(abort_of(write(0x23, 0x1008, 0, 1)), 0x06010002U);
  EXPECT_EQ(abort_of(write(0x60, 0, 0, 0)), 0x05040001U) << "a segment of nothing";
  ASSERT_EQ(answer_to(write(0x40, 0x1008, 0, 0))->data[0], 0x41);
  EXPECT_EQ(abort_of(write(0x70, 0, 0, 0)), 0x05030000U) << "the second segment before the first";
  EXPECT_EQ(abort_of(write(0x60, 0, 0, 0)), 0x05040001U) << "after an abort nothing is left";
  EXPECT_EQ(get_text(0x1008), "Bevel simulated stepper drive");
}

TEST_F(RawDrive, UnitFactors) {
  // 51200 increments a motor revolution, gear 5 to 1, 3600 position units a shaft revolution, velocities in a tenth of
  // it.
  ASSERT_EQ(set(0x6091, 1, 5, 4), 0U);
  ASSERT_EQ(set(0x6092, 1, 3600, 4), 0U);
  ASSERT_EQ(set(0x6096, 2, 10, 4), 0U);
  ASSERT_EQ(set(0x6083, 0, 1000, 4), 0U);
  enable(kProfileVelocity);
  ASSERT_EQ(set(0x60FF, 0, 36, 4), 0U);  // 360 units/s, a tenth of a turn of the shaft, half a turn of the motor
  run_ms(500);
  EXPECT_EQ(get(0x606C), 36);
  const double before = drive->position_unit() * 2000.0;
  const std::int32_t position = get(0x6064);
  run_ms(998);
  EXPECT_NEAR(drive->position_unit() * 2000.0 - before, 25600, 60);
  EXPECT_NEAR(get(0x6064) - position, 360, 2);
  EXPECT_EQ(set(0x6091, 2, 0, 4), kOutOfRange) << "nothing is divided by zero";
}

TEST_F(RawDrive, SoftwareLimitsAreNotPassedAndAreLeftAgain) {
  ASSERT_EQ(set(0x607D, 1, static_cast<std::uint32_t>(-500), 4), 0U);
  ASSERT_EQ(set(0x607D, 2, 3000, 4), 0U);
  EXPECT_EQ(set(0x607D, 1, 3000, 4), kOutOfRange) << "the lower one is below the upper one";
  enable(kProfileVelocity);
  EXPECT_EQ(statusword() & kLimitBit, 0);
  ASSERT_EQ(set(0x60FF, 0, 10000, 4), 0U);
  std::int32_t furthest = 0;
  for (int i = 0; i < 2000; ++i) {
    step();
    furthest = std::max(furthest, static_cast<std::int32_t>(drive->objects().get(0x6064)));
  }
  EXPECT_LE(furthest, 3001);
  EXPECT_NEAR(get(0x6064), 3000, 2);
  EXPECT_EQ(statusword() & (kLimitBit | 0x6F), kLimitBit | 0x27) << "stands at its limit, enabled";
  ASSERT_EQ(set(0x60FF, 0, static_cast<std::uint32_t>(-10000), 4), 0U);
  run_ms(50);
  EXPECT_EQ(statusword() & kLimitBit, 0);
  for (int i = 0; i < 100; ++i) step(20 * kMs_ns);  // called late, it stops at its limit all the same
  EXPECT_NEAR(get(0x6064), -500, 2);
}

TEST_F(RawDrive, ALimitSwitchStopsWhatMovesTowardsIt) {
  rig::SimulatedDriveConfig config;
  config.switches = {-2000.0, 4000.0};
  replace_drive(config);
  ASSERT_EQ(set(0x6085, 0, 50000, 4), 0U);
  enable(kProfileVelocity);
  EXPECT_EQ(get(0x60FD), 0);
  ASSERT_EQ(set(0x60FF, 0, 5000, 4), 0U);
  run_ms(2000);
  EXPECT_EQ(get(0x60FD), 2);
  EXPECT_EQ(get(0x606C), 0);
  EXPECT_EQ(statusword() & kLimitBit, kLimitBit);
  // Way of a quick stop (6085) from 5000/s at 50000/s^2, and the lag.
  EXPECT_NEAR(get(0x6064), 4000 + 5000.0 * 5000.0 / (2 * 50000.0), 30);
  ASSERT_EQ(set(0x60FF, 0, static_cast<std::uint32_t>(-5000), 4), 0U);
  run_ms(3000);
  EXPECT_EQ(get(0x60FD), 1);
  EXPECT_LT(get(0x6064), -2000);
}

TEST_F(RawDrive, HomingOffTheNegativeSwitch) {
  rig::SimulatedDriveConfig config;
  config.switches = {-3000.0, 50'000.0};
  replace_drive(config);
  ASSERT_EQ(set(0x6098, 0, 17, 1), 0U);
  ASSERT_EQ(set(0x607C, 0, 1000, 4), 0U);  // the application's zero is 1000 beyond home
  enable(kHoming);
  run_ms(5);
  EXPECT_EQ(statusword() & 0x3400, 0x0400) << "not started";
  ASSERT_EQ(set(0x6040, 0, 0x1F, 2), 0U);
  run_ms(100);
  EXPECT_EQ(statusword() & 0x3400, 0x0000) << "in progress";
  run_ms(6000);
  EXPECT_EQ(statusword() & 0x3400, 0x1400) << "attained and reached";
  EXPECT_EQ(get(0x60FD), 0);
  EXPECT_NEAR(drive->position_unit() * 2000.0, -3000, 8);
  // Zero is home and 1000: the shaft stands that much below it, and what the ramp from 400/s takes beyond the edge.
  EXPECT_NEAR(get(0x6064) + 1000, drive->position_unit() * 2000.0 + 3000, 5);
}

TEST_F(RawDrive, HomingEndsInterruptedOrFailedAndSaysSo) {
  rig::SimulatedDriveConfig config;
  config.switches = {-3000.0, 3000.0};
  replace_drive(config);
  EXPECT_EQ(set(0x6098, 0, 5, 1), kOutOfRange) << "an index pulse is not there";
  ASSERT_EQ(set(0x6098, 0, 18, 1), 0U);
  enable(kHoming);
  ASSERT_EQ(set(0x6040, 0, 0x1F, 2), 0U);
  run_ms(100);
  ASSERT_EQ(set(0x6040, 0, 0x0F, 2), 0U);
  run_ms(500);
  EXPECT_EQ(statusword() & 0x3400, 0x0400) << "interrupted";
  const std::int32_t stands = get(0x6064);
  run_ms(500);
  EXPECT_EQ(get(0x6064), stands);
  ASSERT_EQ(set(0x6098, 0, 0, 1), 0U);  // no method
  ASSERT_EQ(set(0x6040, 0, 0x1F, 2), 0U);
  run_ms(10);
  EXPECT_EQ(statusword() & 0x3400, 0x2400) << "error, at rest";
}

TEST_F(RawDrive, HomingHere) {
  enable(kProfileVelocity);
  ASSERT_EQ(set(0x60FF, 0, 5000, 4), 0U);
  run_ms(500);
  ASSERT_EQ(set(0x60FF, 0, 0, 4), 0U);
  run_ms(1000);
  ASSERT_GT(get(0x6064), 1000);
  ASSERT_EQ(set(0x6060, 0, kHoming, 1), 0U);
  ASSERT_EQ(set(0x6040, 0, 0x1F, 2), 0U);
  run_ms(5);
  EXPECT_EQ(get(0x6064), 0);
  EXPECT_EQ(statusword() & 0x3400, 0x1400);
}

struct QuickStop {
  std::uint32_t option;
  std::uint32_t ramp;  // of deceleration, per s^2; 0: lets go
  State ends_in;
};
class QuickStopOption : public RawDrive, public testing::WithParamInterface<QuickStop> {};

TEST_P(QuickStopOption, BrakesByItsRampAndEndsInItsState) {
  const QuickStop& wanted = GetParam();
  ASSERT_EQ(set(0x605A, 0, wanted.option, 2), 0U);
  ASSERT_EQ(set(0x6085, 0, 50000, 4), 0U);
  enable(kProfileVelocity);
  ASSERT_EQ(set(0x60FF, 0, 4000, 4), 0U);
  run_ms(600);
  const double before = drive->position_unit();
  ASSERT_EQ(set(0x6040, 0, 0x02, 2), 0U);
  int ms = 1;
  for (; ms < 1000 && drive->velocity_unit_s() > 0.005; ++ms) step();
  const double expected_ms = wanted.ramp == 0 ? 1.0 : 4000.0 / wanted.ramp * 1000.0;
  EXPECT_NEAR(ms, expected_ms, 30);
  EXPECT_NEAR((drive->position_unit() - before) * 2000.0, 4000.0 * expected_ms / 2000.0, 40);
  run_ms(100);
  EXPECT_EQ(drive->state(), wanted.ends_in);
}

INSTANTIATE_TEST_SUITE_P(Of605A, QuickStopOption,
                         testing::Values(QuickStop{0, 0, State::switch_on_disabled},
                                         QuickStop{1, 10000, State::switch_on_disabled},
                                         QuickStop{2, 50000, State::switch_on_disabled},
                                         QuickStop{5, 10000, State::quick_stop_active},
                                         QuickStop{6, 50000, State::quick_stop_active}));

// As it leaves the factory, with nothing set but what it has to watch, commanded by PDOs that do not end.
TEST_F(RawDrive, AMasterWhoseHeartbeatEndsWhilePdosGoOn) {
  for (const auto& [index, sub, value, bytes] : {std::tuple{0x1016, 1, 0x007F0064U, 4U},
                                                 {0x6007, 0, 3U, 2U},
                                                 {0x1600, 1, 0x60400010U, 4U},
                                                 {0x1600, 2, 0x60FF0020U, 4U},
                                                 {0x1600, 0, 2U, 1U},
                                                 {0x1400, 1, 0x201U, 4U},
                                                 {0x6083, 0, 200'000U, 4U}})
    ASSERT_EQ(set(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub), value, bytes), 0U);
  enable(kProfileVelocity);
  (void)peer->send({0x000, 2, {0x01, 0x01}});
  const auto command = [this] { (void)peer->send({0x201, 6, {0x0F, 0x00, 0x40, 0x9C, 0x00, 0x00}}); };  // 40000/s
  for (int ms = 0; ms < 500; ++ms) {
    if (ms % 30 == 0) (void)peer->send({0x77F, 1, {0x05}});
    if (ms % 10 == 0) command();
    step();
  }
  ASSERT_NEAR(drive->velocity_unit_s() * 2000.0, 40000, 40);
  (void)peer->send({0x77F, 1, {0x05}});
  int ms = 0;
  for (; ms < 1000 && drive->velocity_unit_s() > 0.01; ++ms) {
    if (ms % 10 == 0) command();
    step();
  }
  EXPECT_GT(ms, 100);
  EXPECT_LE(ms, 200) << "after the last heartbeat";
}

TEST_F(RawDrive, WhatTheDriveCannotDoIsRefused) {
  for (const std::uint32_t option : {3U, 4U, 7U}) EXPECT_EQ(set(0x605A, 0, option, 2), kOutOfRange) << option;
  for (const std::uint32_t mode : {1U, 2U, 8U, 10U, 0xFFU}) EXPECT_EQ(set(0x6060, 0, mode, 1), kOutOfRange) << mode;
  EXPECT_EQ(get(0x6502), 1 << 2 | 1 << 5 | 1 << 8);
}

TEST_F(RawDrive, FollowingErrorWindow) {
  ASSERT_EQ(set(0x6065, 0, 100, 4), 0U);
  ASSERT_EQ(set(0x6066, 0, 20, 2), 0U);
  enable(kProfileVelocity);
  ASSERT_EQ(set(0x60FF, 0, 4000, 4), 0U);
  run_ms(600);
  EXPECT_EQ(drive->state(), State::operation_enabled) << "16 counts of lag are no error";
  drive->set_motor_blocked(true);
  int ms = 0;
  for (; ms < 1000 && drive->state() == State::operation_enabled; ++ms) step();
  EXPECT_NEAR(ms, (100 - 16) / 4.0 + 20, 3);
  EXPECT_EQ(get(0x603F) & 0xFFFF, 0x8611);
  EXPECT_GT(get(0x60F4), 100);
}

// csv: nothing acts before the SYNC, then the demand runs evenly to the target within 60C2.
TEST_F(RawDrive, CyclicVelocityIsLatchedBySyncAndInterpolated) {
  for (const auto& [index, sub, value, bytes] : {std::tuple{0x1600, 1, 0x60400010U, 4U},
                                                 {0x1600, 2, 0x60FF0020U, 4U},
                                                 {0x1600, 0, 2U, 1U},
                                                 {0x1400, 2, 1U, 1U},
                                                 {0x1400, 1, 0x201U, 4U}})
    ASSERT_EQ(set(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub), value, bytes), 0U);
  enable(kCyclicVelocity);
  (void)peer->send({0x000, 2, {0x01, 0x01}});
  step();
  const auto command = [this](std::uint32_t counts_s) {
    Frame frame{0x201, 6, {0x0F}};
    stepper::cia301::put_u32(frame, 2, counts_s);
    (void)peer->send(frame);
  };
  command(2000);
  run_ms(20);
  EXPECT_EQ(get(0x606C), 0);
  (void)peer->send(stepper::cia301::sync());
  step();  // taken in at its end
  run_ms(5);
  const double lag_s = 0.004;  // of the shaft behind a demand that rises for 5 ms by 200 a ms
  EXPECT_NEAR(drive->velocity_unit_s() * 2000.0, 200e3 * (0.005 - lag_s * (1 - std::exp(-0.005 / lag_s))), 1);
  run_ms(30);
  EXPECT_NEAR(get(0x606C), 2000, 2);
  EXPECT_EQ(statusword() & 0x1400, 0x1000) << "follows";
}

}  // namespace
}  // namespace bevel::test
