// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Homing mode of CiA 402 (mode 6) in the simulated drive. Units are increments and seconds.

#include <cstdint>

namespace bevel::rig {

/// Computes the velocity of a homing run and detects the home position. Methods 17 and 18 (at the edge of the negative
/// or positive limit switch) and 35 and 37 (present position). Uses no clock.
class Homing {
 public:
  /// Settings of a run.
  struct Settings {
    int method = 37;             ///< object 0x6098
    double switch_speed = 0.0;   ///< object 0x6099:1, speed towards the switch, increments/s
    double release_speed = 0.0;  ///< object 0x6099:2, speed off the switch to the edge that is home, increments/s
  };
  /// Inputs of one step.
  struct Inputs {
    bool negative_switch = false;  ///< negative limit switch is closed
    bool positive_switch = false;  ///< positive limit switch is closed
    bool rests = true;             ///< the shaft is stationary
  };

  /// Returns whether a method is supported.
  /// @param method object 0x6098
  /// @return true for 17, 18, 35 and 37
  static bool knows(int method) { return method == 17 || method == 18 || method == 35 || method == 37; }

  /// Starts a run; it fails if the method is not supported.
  /// @param settings settings of the run
  void start(const Settings& settings);
  /// Ends a run without a home position, because the master cleared the start bit, halted or switched off.
  void interrupt();
  /// Forgets the result of the last run.
  void forget() { phase_ = Phase::idle; }

  /// Performs one step.
  /// @param inputs present inputs
  /// @return true in the step at whose end the shaft is at home
  bool step(const Inputs& inputs);
  /// @return target velocity, increments/s
  double target() const { return target_; }
  /// @return true during a run
  bool runs() const { return phase_ == Phase::to_switch || phase_ == Phase::off_switch; }
  /// Computes the bits 10 (target reached), 12 (homing attained) and 13 (homing error) of the statusword.
  /// @param rests the shaft is stationary
  /// @return bits
  std::uint16_t statusword_bits(bool rests) const;

 private:
  enum class Phase : std::uint8_t { idle, to_switch, off_switch, attained, failed };
  void end(Phase how);

  Settings settings_;
  Phase phase_ = Phase::idle;
  double target_ = 0.0;
};

}  // namespace bevel::rig
