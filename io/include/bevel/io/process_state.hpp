// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// States of a process, as process_status_t.state_code carries them.
#include <cstdint>

namespace bevel::io {

/// State of a process.
enum class ProcessState : std::int32_t {
  waiting = 0,      ///< required input is missing
  running = 1,      ///< bevel-camera, bevel-estimator, bevel-rig: in operation
  off = 2,          ///< bevel-controller: not armed; bevel-stepper: no bus, or listening for another master
  configuring = 3,  ///< bevel-stepper: the drives are being configured, or a drive is missing
  ready = 4,        ///< bevel-stepper: configured, power stages off
  enabled = 5,      ///< bevel-stepper: power stages on
  armed = 6,        ///< bevel-controller: ready for request 2 (start)
  steering = 7,     ///< bevel-controller: insertion towards the target
  retracting = 8,   ///< bevel-controller: retraction
  hold = 9,         ///< bevel-controller: holds after a hold request, an arrival or a retraction
  stopped = 10,     ///< latched until request 1 (arm) or 9
  fault = 11,       ///< latched until request 1 (arm) or 9, caused by a fault
};

/// Returns the name of a state for process_status_t.state.
/// @param state  enumerator
/// @return static text; "?" for a value that is not a state
const char* to_string(ProcessState state);

/// Returns whether a state is a latched stop.
/// @param state_code  field of process_status_t
/// @return true for ProcessState::stopped and ProcessState::fault
constexpr bool is_latched_stop(std::int32_t state_code) {
  const auto state = static_cast<ProcessState>(state_code);
  return state == ProcessState::stopped || state == ProcessState::fault;
}

}  // namespace bevel::io
