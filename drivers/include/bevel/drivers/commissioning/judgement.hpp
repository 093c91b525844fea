// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Evaluation of the measurements of bevel-check. Uses no files and no clocks.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <bevel/drivers/commissioning/bus_probe.hpp>
#include <bevel/drivers/commissioning/finding.hpp>

namespace bevel::drivers {

/// Result of measure_multicast().
struct MulticastMeasured {
  bool started = false;         ///< LCM found a route
  int sent = 0,                 ///< messages sent
      heard = 0;                ///< messages received
  std::int64_t longest_ns = 0;  ///< longest time from a message to its reception, ns
};
/// Evaluates multicast.
/// @param measured measurement
/// @return finding
Finding judge_multicast(const MulticastMeasured& measured);

/// Evaluates the bus, and the identity and heartbeat of each drive.
/// @param measured    measurement
/// @param config      settings of the driver
/// @param address     address of the bus, as in system.can
/// @param system_file path of the system file, for remedies
/// @return findings
Findings judge_bus(const BusMeasured& measured, const stepper::StepperConfig& config, const std::string& address,
                   const std::string& system_file);

/// Evaluates the timing of a periodic loop.
/// @param lateness_ns latency of each wake-up, ns
/// @param period_ns   period of the loop, ns
/// @param realtime    the loop ran with real-time scheduling
/// @return finding
Finding judge_timer(std::vector<std::int64_t> lateness_ns, std::int64_t period_ns, bool realtime);

/// Messages of one camera.
struct CameraMeasured {
  int messages = 0;                     ///< number of messages
  std::int64_t longest_silence_ns = 0;  ///< longest time between two messages, ns
};
/// Evaluates the cameras. If one camera sends, all expected cameras must.
/// @param cameras            messages by camera number
/// @param expected           camera numbers of the system file
/// @param listened_ns        duration of the measurement, ns
/// @param allowed_silence_ns longest allowed silence, ns: the estimator's limits.measurement_silence_s
/// @return findings
Findings judge_cameras(std::map<int, CameraMeasured> cameras, const std::vector<int>& expected,
                       std::int64_t listened_ns, std::int64_t allowed_silence_ns);

}  // namespace bevel::drivers
