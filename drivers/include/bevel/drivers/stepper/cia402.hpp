// SPDX-License-Identifier: MIT
// CiA 402 (IEC 61800-7-201): the drive's state machine as seen from the master. Transition numbers are the standard's.
#pragma once

#include <cstdint>

namespace bevel::stepper::cia402 {

enum class State : std::uint8_t {
  not_ready,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction,
  fault,
  unknown,  // a combination of bits that the standard does not define
};

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

inline constexpr std::uint16_t kRemote = 1U << 9;
inline constexpr std::uint16_t kInternalLimit = 1U << 11;

namespace controlword {
inline constexpr std::uint16_t kDisableVoltage = 0x0000;
inline constexpr std::uint16_t kQuickStop = 0x0002;
inline constexpr std::uint16_t kShutdown = 0x0006;
inline constexpr std::uint16_t kSwitchOn = 0x0007;  // also "disable operation"
inline constexpr std::uint16_t kEnableOperation = 0x000F;
inline constexpr std::uint16_t kFaultReset = 0x0080;  // acts on the rising edge
}  // namespace controlword

enum class Goal : std::uint8_t {
  ready,    // ready to switch on: configured, no torque commanded by us
  enabled,  // operation enabled
  stop,     // quick stop, and stay there
};

// The controlword of the next transition from `state` towards `goal`. A fault is left only by a fault reset, which is
// never part of a path: the word is then "disable voltage".
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

const char* to_string(State state);

}  // namespace bevel::stepper::cia402
