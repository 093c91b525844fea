// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// CiA 402 state machine in the simulated drive (IEC 61800-7-201, figure "FSA"), implemented from the drive's side
/// without code of the master that it tests.

#include <cstdint>

namespace bevel::rig {

/// Performs the transitions caused by controlwords, standstill and faults.
class PowerStateMachine {
 public:
  /// States of the drive.
  enum class State : std::uint8_t {
    switch_on_disabled,     ///< switch on disabled
    ready_to_switch_on,     ///< ready to switch on
    switched_on,            ///< switched on
    operation_enabled,      ///< operation enabled
    quick_stop_active,      ///< quick stop active
    fault_reaction_active,  ///< fault reaction active
    fault,                  ///< fault
  };

  /// Performs the transition that a controlword commands.
  /// @param controlword       object 0x6040
  /// @param quick_stop_option object 0x605A: 0 releases the axis immediately; 1 and 2 brake and release it; 5 and 6
  /// brake and
  ///   stay in quick stop
  void on_controlword(std::uint16_t controlword, int quick_stop_option = 2);
  /// Performs the transition at the end of the ramp of a quick stop or of a fault reaction.
  /// @param quick_stop_option object 0x605A
  void on_standstill(int quick_stop_option);
  /// Enters the fault reaction, or the fault state directly if the drive has no torque.
  void on_fault();
  /// Starts a quick stop by the drive itself, such as after the loss of its master.
  /// @param quick_stop_option object 0x605A
  void quick_stop(int quick_stop_option);
  /// Disables the voltage by the drive itself, such as after the loss of its master.
  void disable_voltage();

  /// @return present state
  State state() const { return state_; }
  /// @return bits 0 to 6 of the statusword
  std::uint16_t statusword_bits() const;
  /// @return true if the drive follows its command
  bool moves() const { return state_ == State::operation_enabled; }
  /// @return true during a quick stop or a fault reaction
  bool brakes() const { return state_ == State::quick_stop_active || state_ == State::fault_reaction_active; }
  /// @return true if the motor is energised
  bool has_torque() const { return moves() || brakes() || state_ == State::switched_on; }

 private:
  State state_ = State::switch_on_disabled;
  bool reset_bit_ = false;  // bit 7 of the last controlword
};

}  // namespace bevel::rig
