// SPDX-License-Identifier: MIT
#include <bevel/rig/drives/power_state_machine.hpp>

namespace bevel::rig {
namespace {

constexpr unsigned kSwitchOn = 1U << 0;
constexpr unsigned kEnableVoltage = 1U << 1;
constexpr unsigned kQuickStopOff = 1U << 2;
constexpr unsigned kEnableOperation = 1U << 3;
constexpr unsigned kFaultReset = 1U << 7;

}  // namespace

void PowerStateMachine::on_controlword(std::uint16_t word, int quick_stop_option) {
  const bool reset_edge = (word & kFaultReset) != 0 && !reset_bit_;
  reset_bit_ = (word & kFaultReset) != 0;
  if (state_ == State::fault) {
    if (reset_edge) state_ = State::switch_on_disabled;  // 15
    return;
  }
  if (state_ == State::fault_reaction_active || reset_bit_) return;

  if ((word & kEnableVoltage) == 0) {  // disable voltage: 7, 9, 10, 12
    state_ = State::switch_on_disabled;
    return;
  }
  if ((word & kQuickStopOff) == 0) {  // quick stop: 7, 10, 11
    if (state_ == State::operation_enabled) {
      quick_stop(quick_stop_option);
    } else if (state_ != State::quick_stop_active) {
      state_ = State::switch_on_disabled;
    }
    return;
  }
  const bool switch_on = (word & kSwitchOn) != 0;
  const bool operate = (word & kEnableOperation) != 0;
  switch (state_) {
    case State::switch_on_disabled:
      if (!switch_on) state_ = State::ready_to_switch_on;  // 2
      break;
    case State::ready_to_switch_on:
      if (switch_on) state_ = State::switched_on;  // 3
      break;
    case State::switched_on:
      if (!switch_on) {
        state_ = State::ready_to_switch_on;  // 6
      } else if (operate) {
        state_ = State::operation_enabled;  // 4
      }
      break;
    case State::operation_enabled:
      if (!switch_on) {
        state_ = State::ready_to_switch_on;  // 8
      } else if (!operate) {
        state_ = State::switched_on;  // 5
      }
      break;
    case State::quick_stop_active:  // 16 is optional, and this drive does not have it
    case State::fault_reaction_active:
    case State::fault:
      break;
  }
}

void PowerStateMachine::on_standstill(int quick_stop_option) {
  constexpr int kStaysFrom = 5;  // 5 to 7 stay in quick stop, 0 to 3 go on to "switch on disabled"
  if (state_ == State::fault_reaction_active) state_ = State::fault;                                             // 14
  if (state_ == State::quick_stop_active && quick_stop_option < kStaysFrom) state_ = State::switch_on_disabled;  // 12
}

void PowerStateMachine::on_fault() {
  if (state_ == State::fault) return;
  state_ = has_torque() ? State::fault_reaction_active : State::fault;  // 13
}

void PowerStateMachine::quick_stop(int quick_stop_option) {
  if (state_ == State::operation_enabled)
    state_ = quick_stop_option == 0 ? State::switch_on_disabled : State::quick_stop_active;  // 9 or 11
}

void PowerStateMachine::disable_voltage() {
  if (state_ != State::fault && state_ != State::fault_reaction_active) state_ = State::switch_on_disabled;
}

std::uint16_t PowerStateMachine::statusword_bits() const {
  switch (state_) {
    case State::switch_on_disabled:
      return 0x0040;
    case State::ready_to_switch_on:
      return 0x0031;
    case State::switched_on:
      return 0x0033;
    case State::operation_enabled:
      return 0x0037;
    case State::quick_stop_active:
      return 0x0017;
    case State::fault_reaction_active:
      return 0x001F;
    case State::fault:
      return 0x0008;
  }
  return 0;
}

}  // namespace bevel::rig
