// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/cia402.hpp>

namespace bevel::stepper::cia402 {

const char* to_string(State state) {
  switch (state) {
    case State::not_ready:
      return "not ready to switch on";
    case State::switch_on_disabled:
      return "switch on disabled";
    case State::ready_to_switch_on:
      return "ready to switch on";
    case State::switched_on:
      return "switched on";
    case State::operation_enabled:
      return "operation enabled";
    case State::quick_stop_active:
      return "quick stop active";
    case State::fault_reaction:
      return "fault reaction active";
    case State::fault:
      return "fault";
    case State::unknown:
      break;
  }
  return "unknown";
}

}  // namespace bevel::stepper::cia402
