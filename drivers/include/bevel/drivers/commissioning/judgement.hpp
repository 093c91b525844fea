// SPDX-License-Identifier: MIT
// From what was measured to what is said of it. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <bevel/drivers/commissioning/bus_probe.hpp>
#include <bevel/drivers/commissioning/finding.hpp>

namespace bevel::drivers {

struct MulticastMeasured {
  bool started = false;  // LCM found a route
  int sent = 0, heard = 0;
  std::int64_t longest_ns = 0;  // of one's own message and back
};
Finding judge_multicast(const MulticastMeasured& measured);

// The bus, and for each drive its identity and its heartbeat. address as in system.can.
Findings judge_bus(const BusMeasured& measured, const stepper::StepperConfig& config, const std::string& address,
                   const std::string& system_file);

// lateness_ns: of each wake-up of a loop of this period.
Finding judge_timer(std::vector<std::int64_t> lateness_ns, std::int64_t period_ns, bool realtime);

struct CameraMeasured {
  int messages = 0;
  std::int64_t longest_silence_ns = 0;
};
// By camera number; listened for listened_ns. Where one speaks, all of `expected` must. allowed_silence_ns: the
// estimator's limits.measurement_silence_s.
Findings judge_cameras(std::map<int, CameraMeasured> cameras, const std::vector<int>& expected,
                       std::int64_t listened_ns, std::int64_t allowed_silence_ns);

}  // namespace bevel::drivers
