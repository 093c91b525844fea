// SPDX-License-Identifier: MIT
// The CiA 402 state machine inside the simulated drive (IEC 61800-7-201, figure "FSA"): transitions by controlword, by
// standstill and by faults. Written from the drive's side; shares nothing with the master that it tests.
#pragma once

#include <cstdint>

namespace bevel::rig {

class PowerStateMachine {
 public:
  enum class State : std::uint8_t {
    switch_on_disabled,
    ready_to_switch_on,
    switched_on,
    operation_enabled,
    quick_stop_active,
    fault_reaction_active,
    fault,
  };

  // quick_stop_option: object 605A. 0 lets go at once; 1 and 2 brake and let go; 5 and 6 brake and stay.
  void on_controlword(std::uint16_t controlword, int quick_stop_option = 2);
  void on_standstill(int quick_stop_option);  // the ramp of a quick stop or of a fault reaction has ended
  void on_fault();
  void quick_stop(int quick_stop_option);  // by the drive itself, as on the loss of its master
  void disable_voltage();                  // the same

  State state() const { return state_; }
  std::uint16_t statusword_bits() const;  // bits 0 to 6
  bool moves() const { return state_ == State::operation_enabled; }
  bool brakes() const { return state_ == State::quick_stop_active || state_ == State::fault_reaction_active; }
  bool has_torque() const { return moves() || brakes() || state_ == State::switched_on; }

 private:
  State state_ = State::switch_on_disabled;
  bool reset_bit_ = false;  // bit 7 of the last controlword
};

}  // namespace bevel::rig
