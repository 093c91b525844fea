// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The measurements of bevel-check that need sockets and clocks.

#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>

#include <bevel/drivers/commissioning/judgement.hpp>
#include <bevel/nodes/lcm_port.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::nodes {

/// Measures whether multicast works, by messages to this process on a channel without other subscribers.
/// @param lcm LCM
/// @return numbers of sent and received messages, and the longest delay
drivers::MulticastMeasured measure_multicast(lcm::LCM& lcm);

/// Checks the bus and the drives on it. Takes 2 to 5 s.
/// @param config      settings of the stepper driver
/// @param address     address of the bus (can::open_bus()); an address that can never work is a finding
/// @param system_file path of the system file, for remedies
/// @param meanwhile   called about every millisecond
/// @return findings
drivers::Findings check_bus(const stepper::StepperConfig& config, const std::string& address,
                            const std::string& system_file, const std::function<void()>& meanwhile);

/// Measures the latency of the wake-ups of a periodic loop during one second.
/// @param period_ns period of the loop, ns
/// @return latency of each wake-up, ns
std::vector<std::int64_t> measure_lateness(std::int64_t period_ns);

/// Collects the TIP_MEASUREMENT messages of all cameras since construction.
class CameraEars {
 public:
  /// Subscribes.
  /// @param lcm LCM; must outlive this
  explicit CameraEars(lcm::LCM& lcm);
  /// Handles the messages that have arrived.
  void listen();
  /// @return time since construction, ns
  std::int64_t listened_ns() const;
  /// @return number of messages and longest silence of each camera, by camera number
  std::map<int, drivers::CameraMeasured> heard() const;

 private:
  lcm::LCM& lcm_;
  std::int64_t begun_ns_;
  std::map<int, drivers::CameraMeasured> cameras_;
  std::map<int, std::int64_t> last_ns_;
  nodes::LcmPort port_;
};

/// Performs all checks, each after those that it depends on.
/// @param config      system file
/// @param lcm_url     LCM provider; empty: LCM_DEFAULT_URL
/// @param can         address of the bus (can::open_bus())
/// @param system_file path of the system file, for remedies
/// @return findings
drivers::Findings check_all(const nodes::SystemConfig& config, const std::string& lcm_url, const std::string& can,
                            const std::string& system_file);

}  // namespace bevel::nodes
