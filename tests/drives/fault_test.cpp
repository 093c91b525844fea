// SPDX-License-Identifier: MIT
// Each row of the fault table that can be made on a wire in memory. Every stop is latched: see expect_latched().
#include <gmock/gmock.h>

#include <cstdio>
#include <deque>
#include <random>
#include <utility>

#include "tests/drives/bench.hpp"

namespace bevel::test {
namespace {

using rig::PowerStateMachine;
using stepper::AxisStatus;
using stepper::EnableAnswer;

class Fault : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(bench.enable()) << to_string(bench.reason());
    bench.move(10.0, 3.0);
    bench.run_ms(400);
    ASSERT_GT(bench.insertion.velocity_unit_s(), 9.0);
  }

  void expect_rest_within_ms(int limit_ms) {
    const auto ms = bench.ms_to_rest();
    ASSERT_TRUE(ms.has_value());
    EXPECT_LE(*ms, limit_ms);
    std::printf("%s: at rest after %d ms\n", testing::UnitTest::GetInstance()->current_test_info()->name(), *ms);
  }

  // From here on: a velocity in any command on the wire.
  void watch_for_commands(bool& moves) {
    bench.wire.set_tap([&moves](can::Frame& frame) {
      const bool command = frame.id == 0x201 || frame.id == 0x202;
      moves = moves || (command && stepper::cia301::get_u32(frame, 2) != 0);
      return true;
    });
  }

  // Latched, and fresh set-points and a repaired world change nothing.
  void expect_latched(StopReason reason, DriverState state) {
    bench.run_ms(1000);
    EXPECT_EQ(bench.reason(), reason);
    EXPECT_EQ(bench.report().state, state);
    EXPECT_EQ(bench.driver->enable(), EnableAnswer::not_ready);
    const double before = bench.insertion.position_unit();
    bench.run_ms(500);
    EXPECT_NEAR(bench.insertion.position_unit(), before, 1e-3);
  }

  void expect_rearm_works() {
    ASSERT_TRUE(bench.driver->rearm());
    ASSERT_TRUE(bench.reach(DriverState::ready)) << to_string(bench.reason());
    bench.driver->confirm_position();
    const double before = bench.insertion.position_unit();
    bench.run_ms(300);
    EXPECT_NEAR(bench.insertion.position_unit(), before, 1e-3);  // re-armed is not yet enabled
    ASSERT_TRUE(bench.enable());
    bench.run_ms(400);
    EXPECT_GT(bench.insertion.position_unit(), before + 1.0);
  }

  Bench bench;
};

TEST_F(Fault, DriveHeartbeatLostStopsBothAxes) {
  bench.wire.set_tap([](can::Frame& frame) { return frame.id != 0x701; });
  expect_rest_within_ms(200);  // 30 ms between heartbeats, 100 ms of patience, and the quick stop
  expect_latched(StopReason::drive_heartbeat_lost, DriverState::stopped);
}

TEST_F(Fault, DriveUnplugged) {
  bench.insertion.set_silent(true);  // it cannot hear us either, and has to stop by itself
  expect_rest_within_ms(200);
  expect_latched(StopReason::pdo_lost, DriverState::stopped);
  bench.insertion.set_silent(false);
  expect_latched(StopReason::pdo_lost, DriverState::stopped);
  EXPECT_FALSE(bench.report().position_trusted[0]);
  EXPECT_TRUE(bench.report().position_trusted[1]);
  ASSERT_TRUE(bench.driver->rearm());
  ASSERT_TRUE(bench.reach(DriverState::ready));
  EXPECT_EQ(bench.driver->enable(), EnableAnswer::position_not_trusted);
  bench.driver->confirm_position();
  EXPECT_TRUE(bench.enable());
}

TEST_F(Fault, OurHeartbeatLostStopsTheDrivesByThemselves) {
  bench.driver_runs = false;
  expect_rest_within_ms(200);
  EXPECT_EQ(bench.insertion.state(), PowerStateMachine::State::quick_stop_active);
  EXPECT_EQ(bench.rotation.state(), PowerStateMachine::State::quick_stop_active);
  bench.driver_runs = true;  // continued after a SIGSTOP: its old intent must not restart anything
  bench.run_ms(10);
  expect_latched(StopReason::driver_overrun, DriverState::fault);  // fault: the drives' own complaint comes second
  EXPECT_TRUE(bench.at_rest());
  expect_rearm_works();
}

// The drives' own watch alone: PDOs go on arriving, and neither their emergencies nor their states reach the driver, so
// that it goes on commanding.
TEST_F(Fault, OurHeartbeatLostStopsTheDrivesWhilePdosStillArrive) {
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x181 || frame.id == 0x182) frame.data[0] = 0x37;
    return frame.id != 0x77F && frame.id != 0x081 && frame.id != 0x082;
  });
  expect_rest_within_ms(200);
  EXPECT_EQ(bench.insertion.state(), PowerStateMachine::State::quick_stop_active);
  EXPECT_EQ(bench.rotation.state(), PowerStateMachine::State::quick_stop_active);
  bench.run_ms(50);
  EXPECT_TRUE(bench.at_rest());
}

TEST_F(Fault, AKilledDriverMayBeReplaced) {
  bench.driver_runs = false;
  expect_rest_within_ms(200);
  bench.driver_bus = bench.wire.attach();
  bench.driver = std::make_unique<stepper::StepperDriver>(*bench.driver_bus, bench.config);
  bench.driver_runs = true;
  const double before = bench.insertion.position_unit();
  ASSERT_TRUE(bench.reach(DriverState::ready)) << to_string(bench.reason());
  bench.run_ms(200);
  EXPECT_NEAR(bench.insertion.position_unit(), before, 1e-3);
}

TEST_F(Fault, NodeResetIsNotReadyAndItsPositionNotTrusted) {
  bench.rotation.power_cycle();
  expect_rest_within_ms(100);
  expect_latched(StopReason::drive_reset, DriverState::stopped);
  EXPECT_EQ(bench.report().status[1], AxisStatus::off);
  EXPECT_FALSE(bench.report().position_trusted[1]);
  ASSERT_TRUE(bench.driver->rearm());
  ASSERT_TRUE(bench.reach(DriverState::ready));
  EXPECT_EQ(bench.rotation.objects().get(0x6007), 3U);  // configured anew
  EXPECT_EQ(bench.driver->enable(), EnableAnswer::position_not_trusted);
  bench.driver->set_zero();
  EXPECT_TRUE(bench.enable());
}

TEST_F(Fault, EmergencyIsReportedAndTheOtherAxisQuickStopped) {
  bench.rotation.raise_fault(0x2310);
  expect_rest_within_ms(100);
  expect_latched(StopReason::drive_emergency, DriverState::fault);
  EXPECT_EQ(bench.report().stop.code, 0x2310U);
  EXPECT_EQ(bench.report().stop.axis, 1);
  EXPECT_EQ(bench.report().error_code[1], 0x2310U);
  EXPECT_EQ(bench.report().status[0], AxisStatus::quick_stop);
  EXPECT_EQ(bench.report().status[1], AxisStatus::fault);
  expect_rearm_works();
}

TEST_F(Fault, FaultIsFoundWithoutItsEmergency) {
  bench.wire.set_tap([](can::Frame& frame) { return frame.id != 0x082; });
  bench.rotation.raise_fault(0x4310);
  expect_rest_within_ms(100);
  expect_latched(StopReason::drive_fault, DriverState::fault);
  EXPECT_EQ(bench.report().error_code[1], 0x4310U);  // read from 0x603F
}

// Noticed by the driver before the drive's own window of following error has passed; and what frees the motor later
// does not make the needle jump by what it is behind.
TEST_F(Fault, BlockedMotor) {
  bench.insertion.set_motor_blocked(true);
  expect_rest_within_ms(200);
  expect_latched(StopReason::not_following, DriverState::stopped);
  EXPECT_EQ(bench.report().stop.axis, 0);
  const double before = bench.insertion.position_unit();
  bench.insertion.set_motor_blocked(false);
  bench.run_ms(500);
  EXPECT_NEAR(bench.insertion.position_unit(), before, 1e-3);
}

TEST_F(Fault, LostPdosStopTheAxes) {
  bench.wire.set_tap([](can::Frame& frame) { return frame.id != 0x281; });  // positions of the insertion axis
  expect_rest_within_ms(200);
  expect_latched(StopReason::pdo_lost, DriverState::stopped);
  EXPECT_GT(bench.report().counters.missed_pdos, 0U);
}

TEST_F(Fault, AFewLostPdosAreCountedAndBorne) {
  int n = 0;
  bench.wire.set_tap([&n](can::Frame& frame) { return (frame.id & 0x780) != 0x280 || ++n % 3 != 0; });
  bench.run_ms(1000);
  EXPECT_EQ(bench.report().state, DriverState::enabled);
  EXPECT_GT(bench.report().counters.missed_pdos, 20U);
}

// As a simulated drive on a busy machine, or this process: four questions lie there and are answered in one go.
TEST_F(Fault, ADriveThatStoodStillForAMomentIsNotTwoDrives) {
  for (int i = 0; i < 10; ++i) {
    bench.drives_run = false;
    bench.run_ms(43);
    bench.drives_run = true;
    bench.run_ms(100 + i);
    ASSERT_EQ(bench.report().state, DriverState::enabled) << i << ": " << bench.reason();
  }
  EXPECT_GT(bench.report().counters.missed_pdos, 20U);
}

TEST_F(Fault, TwoDrivesWithOneNodeIdStopTheAxes) {
  // After such a moment too: what it owed is not credit for somebody else.
  bench.drives_run = false;
  bench.run_ms(43);
  bench.drives_run = true;
  bench.run_ms(200);
  std::vector<can::Frame> again;
  bool listening = true;
  bench.wire.set_tap([&](const can::Frame& frame) {
    if (listening && (frame.id == 0x181 || frame.id == 0x281)) again.push_back(frame);
    return true;
  });
  bench.each_ms = [&] {
    listening = false;
    for (const can::Frame& frame : again) bench.wire.inject(frame);
    again.clear();
    listening = true;
  };
  expect_rest_within_ms(300);
  expect_latched(StopReason::second_drive, DriverState::fault);
}

TEST_F(Fault, FrozenPdosOfALivingDrive) {
  bench.insertion.set_pdos_frozen(true);
  bench.run_ms(300);
  EXPECT_EQ(bench.reason(), StopReason::pdo_lost);
  EXPECT_LT(std::abs(bench.rotation.velocity_unit_s()), 0.01);
}

TEST_F(Fault, PdosOfAWrongLengthAreNotTaken) {
  bench.wire.set_tap([](can::Frame& frame) {
    if (frame.id == 0x181) frame.size = 3;
    return true;
  });
  expect_rest_within_ms(200);
  expect_latched(StopReason::pdo_lost, DriverState::stopped);
  EXPECT_GT(bench.report().counters.malformed, 0U);
}

// All of a drive's answers late by 80 ms: they are not taken for those to the newest SYNC.
TEST_F(Fault, DelayedPdosStopTheAxes) {
  std::deque<std::pair<std::int64_t, can::Frame>> late;
  bool passing = false;
  bench.wire.set_tap([&](can::Frame& frame) {
    if (passing || (frame.id != 0x181 && frame.id != 0x281)) return true;
    late.emplace_back(bench.now_ns + 80 * kMs, frame);
    return false;
  });
  bench.each_ms = [&] {
    passing = true;
    for (; !late.empty() && late.front().first <= bench.now_ns; late.pop_front())
      bench.wire.inject(late.front().second);
    passing = false;
  };
  expect_rest_within_ms(200);
  bench.run_ms(300);
  EXPECT_THAT(bench.reason(), testing::AnyOf(StopReason::pdo_lost, StopReason::not_following));
}

// One frame in twenty lost, whatever it is, for ten seconds: borne, or a latched stop; never axes that run on.
TEST_F(Fault, FramesLostAtRandom) {
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    Bench world;
    ASSERT_TRUE(world.enable());
    world.move(5.0, 1.0);
    std::mt19937 random(seed);
    world.wire.set_tap([&random](can::Frame&) { return random() % 20 != 0; });
    world.run_ms(10'000);
    if (world.report().state == DriverState::enabled) {
      EXPECT_NEAR(world.report().insertion_mm, 50.0, 3.0);
    } else {
      EXPECT_TRUE(world.at_rest()) << describe(world.report().stop);
    }
    world.command.reset();  // the controller falls silent, and frames are still being lost
    const auto ms = world.ms_to_rest();
    ASSERT_TRUE(ms.has_value());
    EXPECT_LE(*ms, 200);
  }
}

// A bit that turned on the way: a command with another drive's identifier, a controlword of another state.
TEST_F(Fault, ACorruptedCommandIsUndoneByTheNext) {
  bool corrupted = false;
  bench.wire.set_tap([&corrupted](can::Frame& frame) {
    if (frame.id == 0x201 && !corrupted) {
      corrupted = true;
      frame.data[4] ^= 0x01;  // 65536 counts/s more
    }
    return true;
  });
  bench.run_ms(200);
  EXPECT_TRUE(corrupted);
  EXPECT_EQ(bench.report().state, DriverState::enabled) << describe(bench.report().stop);
  // 607F bounds what the drive makes of it, the ramp what it reaches within a cycle.
  EXPECT_NEAR(bench.report().insertion_rate_mm_s, 10.0, 0.1);
}

TEST_F(Fault, DriveStoppedByAnNmtStateOfItsOwn) {
  bench.wire.inject({0x701, 1, {0x04}});
  expect_rest_within_ms(100);
  expect_latched(StopReason::drive_left_operation, DriverState::stopped);
}

TEST_F(Fault, NobodyAcknowledges_QueuedCommandsAreNeverReplayed) {
  bench.wire.set_acknowledged(false);
  EXPECT_TRUE(bench.run_until([&] { return bench.report().state == DriverState::stopped; }, 200));
  EXPECT_THAT(bench.reason(), testing::AnyOf(StopReason::transmit_stalled, StopReason::pdo_lost));
  expect_rest_within_ms(200);
  EXPECT_GE(bench.report().counters.held_back, 1U);
  // What goes out when the bus returns: not one old velocity.
  bool replayed = false;
  watch_for_commands(replayed);
  bench.run_ms(300);
  bench.wire.set_acknowledged(true);
  bench.run_ms(300);
  EXPECT_FALSE(replayed);
  EXPECT_TRUE(bench.at_rest());
  EXPECT_GE(bench.report().counters.purges, 1U);
  bench.wire.set_tap(nullptr);
  expect_rearm_works();
}

TEST_F(Fault, AtMostOneCommandPerAxisWaits) {
  bench.wire.set_acknowledged(false);
  bench.run_ms(50);                           // several cycles, before any time-out
  EXPECT_LE(bench.driver_bus->queued(), 6U);  // two set-points, SYNC, heartbeat, a read request to each drive
}

TEST_F(Fault, QueueFullIsCountedAndLatched) {
  for (std::size_t i = 0; i < can::MemoryBus::kTransmitQueueFrames; ++i) {
    if (i == 0) bench.wire.set_acknowledged(false);
    (void)bench.driver_bus->send({0x7E0, 0, {}});  // somebody else's frames on our interface
  }
  EXPECT_TRUE(bench.run_until([&] { return bench.report().state == DriverState::stopped; }, 200));
  EXPECT_EQ(bench.reason(), StopReason::queue_full);
  EXPECT_GE(bench.report().counters.queue_full, 5U);
}

TEST_F(Fault, ErrorPassive) {
  bench.wire.raise(can::BusEvent::error_passive);
  bench.run_ms(20);
  EXPECT_EQ(bench.report().counters.purges, 1U);
  expect_rest_within_ms(200);
  expect_latched(StopReason::bus_error_passive, DriverState::stopped);
  expect_rearm_works();
}

TEST_F(Fault, BusOff) {
  bench.wire.raise(can::BusEvent::bus_off);
  expect_rest_within_ms(200);
  expect_latched(StopReason::bus_off, DriverState::stopped);
  bench.wire.raise(can::BusEvent::recovered);
  expect_latched(StopReason::bus_off, DriverState::stopped);
}

TEST_F(Fault, LinkDownIsReopenedButStaysLatched) {
  bench.wire.set_link_up(false);
  expect_rest_within_ms(200);
  expect_latched(StopReason::link_down, DriverState::stopped);
  bool replayed = false;
  watch_for_commands(replayed);
  bench.wire.set_link_up(true);
  bench.run_ms(1500);
  EXPECT_TRUE(bench.driver_bus->is_open());
  EXPECT_FALSE(replayed);
  bench.wire.set_tap(nullptr);
  expect_latched(StopReason::link_down, DriverState::stopped);
  expect_rearm_works();
}

TEST_F(Fault, OperatorStop) {
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  expect_rest_within_ms(100);
  expect_latched(StopReason::operator_stop, DriverState::stopped);
  expect_rearm_works();
}

TEST_F(Fault, TheFirstReasonStays) {
  bench.driver->stop_now(StopReason::operator_stop, bench.now_ns);
  bench.run_ms(50);
  bench.insertion.raise_fault(0x4310);
  bench.run_ms(50);
  EXPECT_EQ(bench.reason(), StopReason::operator_stop);
  EXPECT_EQ(bench.report().state, DriverState::fault);
  EXPECT_GE(bench.report().counters.later_stops, 1U);
}

TEST_F(Fault, ASecondDriverIsRefusedAndDoesNotDisturb) {
  const auto bus = bench.wire.attach();
  stepper::StepperDriver second(*bus, bench.config);
  bench.each_ms = [&] {
    if ((bench.now_ns / kMs) % 10 == 5) second.step(bench.now_ns, std::nullopt);
  };
  bench.run_ms(1000);
  EXPECT_EQ(second.report().state, DriverState::fault);
  EXPECT_EQ(second.report().stop.reason, StopReason::foreign_master);
  EXPECT_EQ(bus->counters().sent, 0U);
  EXPECT_EQ(bench.report().state, DriverState::enabled);
  EXPECT_TRUE(second.rearm());
  bench.run_ms(1000);
  EXPECT_EQ(second.report().stop.reason, StopReason::foreign_master);
  EXPECT_EQ(bus->counters().sent, 0U);
}

TEST_F(Fault, AnotherMasterInFlightStopsTheAxes) {
  bench.wire.inject({0x201, 6, {0x0F, 0x00, 0x10, 0x27, 0x00, 0x00}});
  expect_rest_within_ms(100);
  expect_latched(StopReason::foreign_master, DriverState::fault);
  EXPECT_EQ(bench.report().stop.code, 0x201U);
}

}  // namespace
}  // namespace bevel::test
