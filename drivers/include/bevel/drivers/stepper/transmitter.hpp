// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Transmission with at most one pending frame for each identifier.

#include <array>
#include <cstdint>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::stepper {

/// Sends frames through a bus such that no identifier of the master ever has more than one frame pending. A bus that
/// stalls can then release at most one old command for each drive when it returns.
class Transmitter {
 public:
  /// Creates a transmitter for the identifiers of the master: NMT, SYNC, heartbeat, and RPDO1 and SDO request of each
  /// drive.
  /// @param bus    bus; must outlive the transmitter
  /// @param config settings with the node ids
  Transmitter(can::Bus& bus, const StepperConfig& config);

  /// Sends a frame, unless the previous frame with this identifier is not on the wire yet.
  /// @param frame  frame with an identifier of the master
  /// @param now_ns steady clock, ns
  /// @return false if the frame was not accepted; the caller drops it, or creates a new one in its next step
  bool send(const can::Frame& frame, std::int64_t now_ns);
  /// Records that a frame is on the wire.
  /// @param frame echo received from the bus
  void on_echo(const can::Frame& frame);
  /// Returns whether a frame was accepted and is not on the wire yet.
  /// @param id identifier
  /// @return true if a frame with this identifier is pending
  bool waits_for_echo(std::uint32_t id) const;
  /// Drops all pending frames, after the queue of the bus was lost.
  void forget();

  /// Returns whether only the master of these drives sends an identifier.
  /// @param id identifier
  /// @return true for the identifiers of the constructor
  bool is_ours(std::uint32_t id) const;
  /// Returns the age of the oldest pending frame.
  /// @param now_ns steady clock, ns
  /// @return age, ns; 0 if none is pending
  std::int64_t longest_wait_ns(std::int64_t now_ns) const;
  /// @return number of frames that the bus rejected since the last one it accepted
  int refused_in_a_row() const { return refused_in_a_row_; }
  /// @return number of frames not sent because the previous one with the identifier was pending
  std::uint64_t held_back() const { return held_back_; }

 private:
  struct Slot {
    std::uint32_t id = 0;
    bool outstanding = false;
    std::int64_t sent_ns = 0;
  };
  can::Bus& bus_;
  std::array<Slot, 3 + 2 * kAxes> slots_;  // NMT, SYNC, heartbeat; RPDO1 and SDO request of each drive
  int refused_in_a_row_ = 0;
  std::uint64_t held_back_ = 0;
};

}  // namespace bevel::stepper
