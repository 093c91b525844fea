// SPDX-License-Identifier: MIT
// The driver and two simulated drives over a real CAN_RAW interface, in real time. Run through on_can.sh. The machine
// may be slow and have one processor: these tests assert order and generous bounds.
#include <gmock/gmock.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <thread>

#include <bevel/rig/drives/simulated_drive.hpp>
#include "tests/drives/driven_by_can.hpp"

namespace bevel::test {
namespace {

class SocketCan : public testing::Test {
 protected:
  // Runs drives and driver until the condition holds; false when it did not within the time.
  template <typename Condition>
  bool run_until(Condition condition, int limit_ms = 10'000) {
    const std::int64_t end_ns = clock.now_ns() + limit_ms * kMs;
    while (!condition()) {
      const std::int64_t now_ns = clock.pass();
      if (now_ns > end_ns) return false;
      insertion.step(now_ns);
      rotation.step(now_ns);
      if (master) master->step(now_ns);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  void run_ms(int ms) {
    const std::int64_t end_ns = clock.now_ns() + ms * kMs;
    run_until([&] { return clock.now_ns() >= end_ns; }, ms + 1000);
  }
  bool reach(DriverState state) {
    return run_until([&] { return master->driver.report().state == state; });
  }
  bool at_rest() const { return insertion.velocity_unit_s() == 0.0 && rotation.velocity_unit_s() == 0.0; }

  void start_moving() {
    master = std::make_unique<DrivenByCan>(patient());
    ASSERT_TRUE(reach(DriverState::ready)) << describe(master->driver.report().stop);
    ASSERT_EQ(master->driver.enable(), stepper::EnableAnswer::accepted);
    ASSERT_TRUE(reach(DriverState::enabled)) << describe(master->driver.report().stop);
    master->insertion_rate_mm_s = 5.0;
    master->rotation_rate_rad_s = 2.0;
    ASSERT_TRUE(run_until([&] { return insertion.position_unit() > 2.0; }));
  }

  Clock clock;
  const StepperConfig config = patient();
  std::unique_ptr<can::Bus> insertion_bus = can::open_bus(kInterface);
  std::unique_ptr<can::Bus> rotation_bus = can::open_bus(kInterface);
  rig::SimulatedDrive insertion{*insertion_bus, {1, config.axes[0].counts_per_unit, 0.004, {}}};
  rig::SimulatedDrive rotation{*rotation_bus, {2, config.axes[1].counts_per_unit, 0.004, {}}};
  std::unique_ptr<DrivenByCan> master;
};

TEST_F(SocketCan, FiltersAreExactAndOwnFramesComeBackAsEchoes) {
  const auto a = can::open_bus(kInterface, std::vector<std::uint32_t>{0x123});
  const auto b = can::open_bus(kInterface, std::vector<std::uint32_t>{0x123});
  for (const std::uint32_t id : {0x122U, 0x123U, 0x124U, 0x523U})
    ASSERT_EQ(a->send({id, 1, {7}}), can::SendResult::sent);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const auto echo = a->receive();
  EXPECT_EQ(echo.kind, can::Reception::Kind::echo);
  EXPECT_EQ(echo.frame, (can::Frame{0x123, 1, {7}}));
  EXPECT_EQ(a->receive().kind, can::Reception::Kind::nothing);
  EXPECT_EQ(b->receive().kind, can::Reception::Kind::frame);
  EXPECT_EQ(b->receive().kind, can::Reception::Kind::nothing);
}

TEST_F(SocketCan, UnreadFramesAreCountedAsLost) {
  const auto reader = can::open_bus(kInterface);
  const auto writer = can::open_bus(kInterface, std::vector<std::uint32_t>{0x7FF});
  for (int i = 0; i < 20'000; ++i) (void)writer->send({0x7F0, 8, {}});
  bool reported = false;
  for (int more = 0; more < 3; ++more) {
    for (auto found = reader->receive(); found.kind != can::Reception::Kind::nothing; found = reader->receive())
      reported = reported || (found.kind == can::Reception::Kind::event && found.event == can::BusEvent::overflow);
    (void)writer->send({0x7F0, 8, {}});  // the count travels with the next frame
  }
  EXPECT_TRUE(reported);
  EXPECT_GT(reader->counters().overflows, 0U);
}

TEST_F(SocketCan, EnableMoveAndPositionsAgree) {
  start_moving();
  master->insertion_rate_mm_s = master->rotation_rate_rad_s = 0.0;
  ASSERT_TRUE(run_until([&] { return std::abs(insertion.velocity_unit_s()) < 1e-6; }));
  run_ms(200);
  const auto report = master->driver.report();
  EXPECT_EQ(report.state, DriverState::enabled) << describe(report.stop);
  EXPECT_NEAR(report.insertion_mm, insertion.position_unit(), 0.01);
  EXPECT_NEAR(report.rotation_rad, rotation.position_unit(), 0.01);
  EXPECT_GT(report.insertion_mm, 2.0);
  EXPECT_GT(report.rotation_rad, 0.3);
  EXPECT_EQ(report.counters.malformed, 0U);
}

TEST_F(SocketCan, AKilledDriverLetsTheDrivesStopByThemselves) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    DrivenByCan alone(patient());
    alone.insertion_rate_mm_s = 5.0;
    alone.rotation_rate_rad_s = 2.0;
    for (;;) {
      alone.step(clock.pass());
      (void)alone.driver.enable();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  EXPECT_TRUE(run_until([&] { return insertion.position_unit() > 2.0; }));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_FALSE(at_rest());
  EXPECT_TRUE(run_until([&] { return at_rest(); }, 3000));
  EXPECT_EQ(insertion.state(), rig::PowerStateMachine::State::quick_stop_active);
  EXPECT_EQ(rotation.state(), rig::PowerStateMachine::State::quick_stop_active);
}

TEST_F(SocketCan, ASecondDriverIsRefused) {
  start_moving();
  DrivenByCan second(patient());
  ASSERT_TRUE(run_until([&] {
    second.step(clock.now_ns());
    return second.driver.report().state == DriverState::fault;
  }));
  EXPECT_EQ(second.driver.report().stop.reason, StopReason::foreign_master);
  EXPECT_EQ(second.bus->counters().sent, 0U);
  EXPECT_EQ(master->driver.report().state, DriverState::enabled);
}

TEST_F(SocketCan, LinkDownIsALatchedStopAndIsReopened) {
  start_moving();
  if (!ip("link set " + kInterface + " down")) GTEST_SKIP() << "not permitted to take the link down";
  EXPECT_TRUE(reach(DriverState::stopped));
  EXPECT_EQ(master->driver.report().stop.reason, StopReason::link_down);
  EXPECT_TRUE(run_until([&] { return at_rest(); }, 3000));
  ASSERT_TRUE(ip("link set " + kInterface + " up"));
  EXPECT_TRUE(run_until([&] { return master->bus->is_open(); }));
  const double before = insertion.position_unit();
  run_ms(1000);
  EXPECT_NEAR(insertion.position_unit(), before, 1e-3);
  EXPECT_GE(master->driver.report().state, DriverState::stopped);
  EXPECT_EQ(master->driver.report().stop.reason, StopReason::link_down);
  ASSERT_TRUE(master->driver.rearm());
  EXPECT_TRUE(reach(DriverState::ready)) << describe(master->driver.report().stop);
}

TEST_F(SocketCan, ErrorPassiveStopsAndPurges) {
  start_moving();
  // vcan passes error frames on like any other: the kernel's own encoding, without a controller.
  const int raw = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(kInterface.c_str()));
  ASSERT_EQ(::bind(raw, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  can_frame error{};
  error.can_id = CAN_ERR_FLAG | CAN_ERR_CRTL;
  error.can_dlc = CAN_ERR_DLC;
  error.data[1] = CAN_ERR_CRTL_TX_PASSIVE;
  ASSERT_EQ(::write(raw, &error, sizeof error), static_cast<ssize_t>(sizeof error));
  ::close(raw);
  EXPECT_TRUE(reach(DriverState::stopped));
  EXPECT_EQ(master->driver.report().stop.reason, StopReason::bus_error_passive);
  EXPECT_TRUE(run_until([&] { return at_rest(); }, 3000));
  EXPECT_GE(master->bus->counters().error_frames, 1U);
  EXPECT_EQ(master->driver.report().counters.purges, 1U);
}

TEST_F(SocketCan, AnInterfaceThatGoesAndComesBackIsFoundAgain) {
  if (!ip("link add bevel0 type vcan") || !ip("link set bevel0 up")) GTEST_SKIP() << "not permitted to add a vcan";
  const auto bus = can::open_bus("bevel0");
  ASSERT_TRUE(bus->is_open());
  ASSERT_TRUE(ip("link del bevel0"));
  const auto event = bus->receive();
  EXPECT_EQ(event.kind, can::Reception::Kind::event);
  EXPECT_THAT(event.event, testing::AnyOf(can::BusEvent::gone, can::BusEvent::link_down));
  bus->maintain(0);
  EXPECT_FALSE(bus->is_open());
  ASSERT_TRUE(ip("link add bevel0 type vcan") && ip("link set bevel0 up"));
  bus->maintain(10'000'000'000);
  EXPECT_TRUE(bus->is_open());
  EXPECT_EQ(bus->send({0x123, 0, {}}), can::SendResult::sent);
  EXPECT_TRUE(ip("link del bevel0"));
}

}  // namespace
}  // namespace bevel::test
