// SPDX-License-Identifier: MIT
// Homing mode of CiA 402 (mode 6) inside the simulated drive: which way to turn, and where home is. Methods 17 and 18
// (off the edge of the negative or positive limit switch) and 35 and 37 (here). Pure; increments and seconds.
#pragma once

#include <cstdint>

namespace bevel::rig {

class Homing {
 public:
  struct Settings {
    int method = 37;             // 6098
    double switch_speed = 0.0;   // 6099:1, towards the switch
    double release_speed = 0.0;  // 6099:2, off it again: the edge that is home
  };
  struct Inputs {
    bool negative_switch = false;
    bool positive_switch = false;
    bool rests = true;
  };

  static bool knows(int method) { return method == 17 || method == 18 || method == 35 || method == 37; }

  void start(const Settings& settings);
  void interrupt();  // the master took its start bit back, halted or switched off: not homed
  void forget() { phase_ = Phase::idle; }

  // Once a step: true in the one at whose end the shaft is at home.
  bool step(const Inputs& inputs);
  double target() const { return target_; }
  bool runs() const { return phase_ == Phase::to_switch || phase_ == Phase::off_switch; }
  // Bits 10 (target reached), 12 (homing attained) and 13 (homing error).
  std::uint16_t statusword_bits(bool rests) const;

 private:
  enum class Phase : std::uint8_t { idle, to_switch, off_switch, attained, failed };
  void end(Phase how);

  Settings settings_;
  Phase phase_ = Phase::idle;
  double target_ = 0.0;
};

}  // namespace bevel::rig
