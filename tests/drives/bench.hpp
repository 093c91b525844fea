// SPDX-License-Identifier: MIT
// A test bench in simulated time: the driver and two simulated drives on one wire, one millisecond per tick.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/drivers/stepper/stepper_driver.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>

namespace bevel::stepper {
inline std::ostream& operator<<(std::ostream& out, DriverState state) { return out << to_string(state); }
inline std::ostream& operator<<(std::ostream& out, StopReason reason) { return out << to_string(reason); }
}  // namespace bevel::stepper

namespace bevel::test {

using stepper::DriverState;
using stepper::kMs;
using stepper::StopReason;

class Bench {
 public:
  static constexpr std::int64_t kStart_ns = 1'000'000'000;

  explicit Bench(const stepper::StepperConfig& settings = {}, const rig::LimitSwitches& insertion_switches = {},
                 const rig::DriveDialect& insertion_dialect = {})
      : config(settings),
        driver_bus(wire.attach()),
        drive_buses{wire.attach(), wire.attach()},
        insertion(*drive_buses[0], drive_config(0, insertion_switches, insertion_dialect)),
        rotation(*drive_buses[1], drive_config(1, {}, {})),
        driver(std::make_unique<stepper::StepperDriver>(*driver_bus, config)) {}

  // Runs the world for a while; the set-point is handed in anew in each cycle unless `command` says otherwise.
  void run_ms(int ms) {
    for (int i = 0; i < ms; ++i) {
      now_ns += kMs;
      if (drives_run) {
        insertion.step(now_ns);
        rotation.step(now_ns);
      }
      if (driver_runs && (now_ns / kMs) % (config.period_ns / kMs) == 0) driver->step(now_ns, command);
      if (each_ms) each_ms();
    }
  }

  // Runs until the condition holds; false when it did not within the time.
  bool run_until(const std::function<bool()>& condition, int limit_ms = 5000) {
    for (int i = 0; i < limit_ms && !condition(); ++i) run_ms(1);
    return condition();
  }

  bool reach(DriverState state, int limit_ms = 5000) {
    return run_until([&] { return driver->report().state == state; }, limit_ms);
  }

  bool enable() {
    if (!reach(DriverState::ready)) return false;
    if (driver->enable() != stepper::EnableAnswer::accepted) return false;
    return reach(DriverState::enabled);
  }

  void move(double insertion_mm_s, double rotation_rad_s) {
    command = stepper::MotionSetpoint{0, true, insertion_mm_s, rotation_rad_s};
  }

  bool at_rest() const { return insertion.velocity_unit_s() == 0.0 && rotation.velocity_unit_s() == 0.0; }

  // How long until both shafts rest, in ms; nothing if longer than the limit.
  std::optional<int> ms_to_rest(int limit_ms = 1000) {
    for (int ms = 0; ms <= limit_ms; ++ms) {
      if (std::abs(insertion.velocity_unit_s()) < 0.01 && std::abs(rotation.velocity_unit_s()) < 0.01) return ms;
      run_ms(1);
    }
    return std::nullopt;
  }

  stepper::AxesReport report() const { return driver->report(); }
  StopReason reason() const { return driver->report().stop.reason; }

  stepper::StepperConfig config;
  can::MemoryNetwork wire;
  std::unique_ptr<can::MemoryBus> driver_bus;
  std::array<std::unique_ptr<can::MemoryBus>, 2> drive_buses;
  rig::SimulatedDrive insertion;
  rig::SimulatedDrive rotation;
  std::unique_ptr<stepper::StepperDriver> driver;
  std::optional<stepper::MotionSetpoint> command = stepper::MotionSetpoint{};
  std::function<void()> each_ms;
  bool drives_run = true;
  bool driver_runs = true;
  std::int64_t now_ns = kStart_ns;

 private:
  rig::SimulatedDriveConfig drive_config(std::size_t axis, const rig::LimitSwitches& switches,
                                         const rig::DriveDialect& dialect) const {
    rig::SimulatedDriveConfig drive;
    drive.node_id = config.axes.at(axis).node_id;
    drive.counts_per_unit = config.axes.at(axis).counts_per_unit;
    drive.switches = switches;
    drive.dialect = dialect;
    return drive;
  }
};

}  // namespace bevel::test
