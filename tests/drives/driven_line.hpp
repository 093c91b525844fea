// SPDX-License-Identifier: MIT
// The driver at one end of a line of the kernel's, two simulated drives at the other, in real time: what the tests
// share that spoil what is between the ends.
#pragma once

#include <gmock/gmock.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include <bevel/rig/drives/simulated_drive.hpp>
#include "tests/drives/driven_by_can.hpp"

namespace bevel::test {

class DrivenLine : public testing::Test {
 protected:
  // Both ends are up: configures the drives, enables them, and returns while both axes move.
  void start(const std::string& driver_end, const std::string& drive_end) {
    insertion_bus_ = can::open_bus(drive_end);
    rotation_bus_ = can::open_bus(drive_end);
    insertion = std::make_unique<rig::SimulatedDrive>(
        *insertion_bus_, rig::SimulatedDriveConfig{1, patient().axes[0].counts_per_unit, 0.004, {}, {}});
    rotation = std::make_unique<rig::SimulatedDrive>(
        *rotation_bus_, rig::SimulatedDriveConfig{2, patient().axes[1].counts_per_unit, 0.004, {}, {}});
    master = std::make_unique<DrivenByCan>(patient(), driver_end);
    ASSERT_TRUE(run_until([&] { return state() == DriverState::ready; })) << describe(stop());
    ASSERT_EQ(master->driver.enable(), stepper::EnableAnswer::accepted);
    ASSERT_TRUE(run_until([&] { return state() == DriverState::enabled; })) << describe(stop());
    master->insertion_rate_mm_s = 5.0;
    master->rotation_rate_rad_s = 2.0;
    ASSERT_TRUE(run_until([&] { return insertion->position_unit() > 2.0; })) << describe(stop());
  }

  // Makes the line as good as it was at the start.
  virtual bool repair() = 0;

  template <typename Condition>
  bool run_until(Condition condition, int limit_ms = 10'000) {
    for (const std::int64_t end_ns = clock_.now_ns() + limit_ms * kMs; !condition();) {
      const std::int64_t now_ns = clock_.pass();
      if (now_ns > end_ns) return false;
      insertion->step(now_ns);
      rotation->step(now_ns);
      master->step(now_ns);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  void run_ms(int ms) {
    run_until([] { return false; }, ms);
  }
  bool at_rest() const { return insertion->velocity_unit_s() == 0.0 && rotation->velocity_unit_s() == 0.0; }
  DriverState state() const { return master->driver.report().state; }
  stepper::Stop stop() const { return master->driver.report().stop; }

  // Stopped for good: the line repaired, the commands still fresh, and nothing moves.
  void expect_latched_at_rest() {
    EXPECT_TRUE(run_until([this] { return state() >= DriverState::stopped; }, 3000));
    EXPECT_TRUE(run_until([this] { return at_rest(); }, 3000)) << describe(stop());
    ASSERT_TRUE(repair());
    run_ms(300);
    const double rests_mm = insertion->position_unit(), rests_rad = rotation->position_unit();
    run_ms(1000);
    EXPECT_GE(state(), DriverState::stopped);
    EXPECT_NEAR(insertion->position_unit(), rests_mm, 1e-3);
    EXPECT_NEAR(rotation->position_unit(), rests_rad, 1e-3);
  }
  // Borne: on its way, and the driver knows where.
  void expect_borne() {
    const double before_mm = insertion->position_unit();
    run_ms(3000);
    EXPECT_EQ(state(), DriverState::enabled) << describe(stop());
    EXPECT_GT(insertion->position_unit(), before_mm + 10.0);
    EXPECT_NEAR(master->driver.report().insertion_mm, insertion->position_unit(), 1.0);
  }

  Clock clock_;
  std::unique_ptr<can::Bus> insertion_bus_, rotation_bus_;

 public:
  std::unique_ptr<rig::SimulatedDrive> insertion, rotation;
  std::unique_ptr<DrivenByCan> master;
};

}  // namespace bevel::test
