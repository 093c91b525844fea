// SPDX-License-Identifier: MIT
// Sends through a bus such that no identifier of ours ever has more than one frame waiting: a bus that stalls can then
// release at most one old command per drive when it returns.
#pragma once

#include <array>
#include <cstdint>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>

namespace bevel::stepper {

class Transmitter {
 public:
  Transmitter(can::Bus& bus, const StepperConfig& config);

  // False: not accepted, because the previous frame with this identifier is not on the wire yet or the bus refused.
  // The caller drops the frame, or makes a new one in its next step.
  bool send(const can::Frame& frame, std::int64_t now_ns);
  void on_echo(const can::Frame& frame);
  bool waits_for_echo(std::uint32_t id) const;  // a frame with this identifier was accepted and is not on the wire yet
  void forget();                                // after the queue was lost: nothing is outstanding any more

  bool is_ours(std::uint32_t id) const;  // an identifier that only the master of these drives sends
  std::int64_t longest_wait_ns(std::int64_t now_ns) const;
  int refused_in_a_row() const { return refused_in_a_row_; }
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
