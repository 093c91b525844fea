// SPDX-License-Identifier: MIT
// The driver on a real CAN_RAW interface, in real time: what the tests on vcan and on slcan share.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <string>

#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/drivers/stepper/stepper_driver.hpp>

namespace bevel::test {

using stepper::DriverState;
using stepper::kMs;
using stepper::StepperConfig;
using stepper::StepperDriver;
using stepper::StopReason;

inline const std::string kInterface = "vcan0";

// The clock that drives and driver are stepped with: the machine's, except that between two passes at most 20 ms go by.
// Where a pass takes longer (a loaded machine, an emulated one that starts `ip` for half a second), all parties stood
// still, and none of them may take that for another one's silence.
class Clock {
 public:
  std::int64_t pass() {
    const std::int64_t steady_ns = machine_ns();
    now_ns_ += std::min(steady_ns - last_ns_, 20 * kMs);
    last_ns_ = steady_ns;
    return now_ns_;
  }
  std::int64_t now_ns() const { return now_ns_; }

 private:
  static std::int64_t machine_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  std::int64_t last_ns_ = machine_ns();
  std::int64_t now_ns_ = last_ns_;
};

inline StepperConfig patient() {
  StepperConfig config;
  config.master_heartbeat_timeout_ns = 400 * kMs;
  config.drive_heartbeat_timeout_ns = 400 * kMs;
  config.tpdo_timeout_ns = 300 * kMs;
  config.echo_timeout_ns = 300 * kMs;
  config.overrun_stop_ns = 1000 * kMs;
  config.not_following_ns = 1000 * kMs;
  return config;
}

// Taking links up and down needs CAP_NET_ADMIN.
inline bool ip(const std::string& arguments) { return std::system(("ip " + arguments + " 2>/dev/null").c_str()) == 0; }

class DrivenByCan {
 public:
  explicit DrivenByCan(const StepperConfig& settings, const std::string& interface = kInterface)
      : config(settings), bus(can::open_bus(interface, StepperDriver::listen_ids(config))), driver(*bus, config) {}

  void step(std::int64_t now_ns) {
    if (now_ns < next_ns_) return driver.receive(now_ns);
    next_ns_ = std::max(next_ns_ + config.period_ns, now_ns);
    driver.step(now_ns, stepper::MotionSetpoint{0, true, insertion_rate_mm_s, rotation_rate_rad_s});
  }

  StepperConfig config;
  std::unique_ptr<can::Bus> bus;
  StepperDriver driver;
  double insertion_rate_mm_s = 0.0;
  double rotation_rate_rad_s = 0.0;

 private:
  std::int64_t next_ns_ = 0;
};

}  // namespace bevel::test
