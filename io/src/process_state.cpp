// SPDX-License-Identifier: MIT
#include <bevel/io/process_state.hpp>

namespace bevel::io {

const char* to_string(ProcessState state) {
  switch (state) {
    case ProcessState::waiting:
      return "waiting";
    case ProcessState::running:
      return "running";
    case ProcessState::off:
      return "off";
    case ProcessState::configuring:
      return "configuring";
    case ProcessState::ready:
      return "ready";
    case ProcessState::enabled:
      return "enabled";
    case ProcessState::armed:
      return "armed";
    case ProcessState::steering:
      return "steering";
    case ProcessState::retracting:
      return "retracting";
    case ProcessState::hold:
      return "hold";
    case ProcessState::stopped:
      return "stopped";
    case ProcessState::fault:
      return "fault";
  }
  return "?";
}

}  // namespace bevel::io
