// SPDX-License-Identifier: MIT
// The measurements of bevel-check that need sockets and clocks.
#pragma once

#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>

#include <bevel/drivers/commissioning/judgement.hpp>
#include <bevel/nodes/lcm_port.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::nodes {

// Sends itself messages on a channel that nobody else reads.
drivers::MulticastMeasured measure_multicast(lcm::LCM& lcm);

// Findings about the bus and the drives on it; an address that can never work is one of them. Takes 2 to 5 s, in which
// `meanwhile` is called about every millisecond.
drivers::Findings check_bus(const stepper::StepperConfig& config, const std::string& address,
                            const std::string& system_file, const std::function<void()>& meanwhile);

// Lateness of each wake-up of a loop of this period, for a second.
std::vector<std::int64_t> measure_lateness(std::int64_t period_ns);

// TIP_MEASUREMENT of every camera, from now on.
class CameraEars {
 public:
  explicit CameraEars(lcm::LCM& lcm);  // must outlive this
  void listen();                       // handles what has arrived
  std::int64_t listened_ns() const;
  std::map<int, drivers::CameraMeasured> heard() const;

 private:
  lcm::LCM& lcm_;
  std::int64_t begun_ns_;
  std::map<int, drivers::CameraMeasured> cameras_;
  std::map<int, std::int64_t> last_ns_;
  nodes::LcmPort port_;
};

// All of them, in the order in which one is needed for the next.
drivers::Findings check_all(const nodes::SystemConfig& config, const std::string& lcm_url, const std::string& can,
                            const std::string& system_file);

}  // namespace bevel::nodes
