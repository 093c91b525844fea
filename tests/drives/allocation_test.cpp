// SPDX-License-Identifier: MIT
// No allocation in what the driver does on a bus over sockets, from configuring to a stop and again: operator new is
// counted.
#include <gtest/gtest.h>

#include <bevel/drivers/can/local_bus.hpp>
#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/drivers/stepper/stepper_driver.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>
#include "tests/support/count_allocations.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::test {
namespace {

using stepper::DriverState;
using stepper::kMs;

TEST(StepperDriver, AllocatesNothingInItsSteps) {
  TemporaryFolder folder;
  const std::string path = (folder / "bus").string();
  can::LocalHub hub(path);
  const stepper::StepperConfig config;
  const auto bus = can::open_bus("unix:" + path, stepper::StepperDriver::listen_ids(config));
  const std::array drive_buses{can::open_bus("unix:" + path), can::open_bus("unix:" + path)};
  rig::SimulatedDriveConfig one, other;
  one.node_id = config.axes[0].node_id;
  other.node_id = config.axes[1].node_id;
  rig::SimulatedDrive insertion(*drive_buses[0], one), rotation(*drive_buses[1], other);
  stepper::StepperDriver driver(*bus, config);

  long allocated = 0;
  std::int64_t now_ns = 1000 * kMs;
  const auto counted = [&allocated](const auto& act) {
    const long before = testing::allocations;
    act();
    allocated += testing::allocations - before;
  };
  const auto run_until = [&](DriverState state, int longest_ms) {
    for (int ms = 0; ms < longest_ms && driver.report().state != state; ++ms) {
      now_ns += kMs;
      hub.service();
      insertion.step(now_ns);
      rotation.step(now_ns);
      hub.service();
      counted([&] { driver.receive(now_ns); });
      if (ms % 10 == 0) counted([&] { driver.step(now_ns, stepper::MotionSetpoint{0, true, 5.0, 1.0}); });
      if (ms % 10 == 3) counted([&] { driver.take(now_ns, {0, true, 5.0 + 0.001 * ms, 1.0}); });
    }
    return driver.report().state == state;
  };
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(run_until(DriverState::ready, 3000)) << describe(driver.report().stop);
    counted([&] { (void)driver.enable(); });
    ASSERT_TRUE(run_until(DriverState::enabled, 1000)) << describe(driver.report().stop);
    run_until(DriverState::stopped, 500);
    ASSERT_EQ(driver.report().state, DriverState::enabled);
    counted([&] { driver.stop_now(stepper::StopReason::operator_stop, now_ns); });
    run_until(DriverState::off, 200);
    counted([&] { driver.rearm(); });
  }
  EXPECT_EQ(allocated, 0);
}

}  // namespace
}  // namespace bevel::test
