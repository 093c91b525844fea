// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// State machine of a drive as seen from the master (CiA 402, IEC 61800-7-201). Transition numbers are the standard's.

#include <cstdint>

namespace bevel::stepper::cia402 {

/// States of the drive.
enum class State : std::uint8_t {
  not_ready,           ///< not ready to switch on
  switch_on_disabled,  ///< switch on disabled
  ready_to_switch_on,  ///< ready to switch on
  switched_on,         ///< switched on
  operation_enabled,   ///< operation enabled
  quick_stop_active,   ///< quick stop active
  fault_reaction,      ///< fault reaction active
  fault,               ///< fault
  unknown,             ///< a combination of bits that the standard does not define
};

/// Decodes the state from a statusword (0x6041).
/// @param statusword statusword as received
/// @return state; State::unknown if the standard does not define the combination of bits
constexpr State decode(std::uint16_t statusword) {
  switch (statusword & 0x4F) {
    case 0x00:
      return State::not_ready;
    case 0x40:
      return State::switch_on_disabled;
    case 0x0F:
      return State::fault_reaction;
    case 0x08:
      return State::fault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return State::ready_to_switch_on;
    case 0x23:
      return State::switched_on;
    case 0x27:
      return State::operation_enabled;
    case 0x07:
      return State::quick_stop_active;
    default:
      return State::unknown;
  }
}

/// Statusword bit 9: the drive obeys the controlword.
inline constexpr std::uint16_t kRemote = 1U << 9;
/// Statusword bit 11: an internal limit is active.
inline constexpr std::uint16_t kInternalLimit = 1U << 11;

/// Commands of the controlword (0x6040).
namespace controlword {
inline constexpr std::uint16_t kDisableVoltage = 0x0000;   ///< disable voltage
inline constexpr std::uint16_t kQuickStop = 0x0002;        ///< quick stop
inline constexpr std::uint16_t kShutdown = 0x0006;         ///< shutdown
inline constexpr std::uint16_t kSwitchOn = 0x0007;         ///< switch on; in operation enabled: disable operation
inline constexpr std::uint16_t kEnableOperation = 0x000F;  ///< enable operation
inline constexpr std::uint16_t kFaultReset = 0x0080;       ///< fault reset; acts on the rising edge
}  // namespace controlword

/// State that the master wants a drive to reach.
enum class Goal : std::uint8_t {
  ready,    ///< ready to switch on: configured, no torque commanded by the master
  enabled,  ///< operation enabled
  stop,     ///< quick stop, held
};

/// Returns the controlword of the next transition from a state towards a goal. A fault is left only by a fault reset,
/// which is never part of a path: in a fault the result is "disable voltage", or "quick stop" for Goal::stop.
/// @param goal  state to reach
/// @param state present state of the drive
/// @return controlword (0x6040)
constexpr std::uint16_t controlword_towards(Goal goal, State state) {
  using namespace controlword;
  switch (state) {
    case State::switch_on_disabled:
      return goal == Goal::stop ? kDisableVoltage : kShutdown;  // 2
    case State::ready_to_switch_on:
      if (goal == Goal::stop) return kQuickStop;             // 7
      return goal == Goal::enabled ? kSwitchOn : kShutdown;  // 3
    case State::switched_on:
      if (goal == Goal::stop) return kQuickStop;                    // 10
      return goal == Goal::enabled ? kEnableOperation : kShutdown;  // 4, 6
    case State::operation_enabled:
      if (goal == Goal::stop) return kQuickStop;                    // 11
      return goal == Goal::enabled ? kEnableOperation : kSwitchOn;  // stay, 5
    case State::quick_stop_active:
      return goal == Goal::stop ? kQuickStop : kDisableVoltage;  // stay, 12; transition 16 is optional in drives
    case State::not_ready:
    case State::fault_reaction:
    case State::fault:
    case State::unknown:
      break;
  }
  return goal == Goal::stop ? kQuickStop : kDisableVoltage;
}

/// Returns the name of a state.
/// @param state state
/// @return static string
const char* to_string(State state);

}  // namespace bevel::stepper::cia402
