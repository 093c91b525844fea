// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// A drive's connection to the bus with a fault: the counterpart of FaultInjector for CAN. Only for the simulated rig.
#include <deque>
#include <limits>
#include <random>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/nodes/fault_injector.hpp>

namespace bevel::nodes {

/// Bus that corrupts the frames of one drive.
class FaultyBus : public can::Bus {
 public:
  /// Creates a bus that passes everything on until begin().
  /// @param inner   bus of the drive; must outlive this
  /// @param node_id node id of the drive
  FaultyBus(can::Bus& inner, std::uint8_t node_id) : inner_(inner), node_id_(node_id) {}
  /// Starts the fault. FaultKind::stuck has no effect here: it concerns the motor, not the bus.
  /// @param kind     kind of fault
  /// @param start_ns start of the fault, in the clock of maintain(), ns
  /// @param seed     seed of the durations and bytes
  void begin(FaultKind kind, std::int64_t start_ns, std::uint64_t seed);
  /// Ends the fault.
  void end() { start_ns_ = std::numeric_limits<std::int64_t>::max(); }

  can::SendResult send(const can::Frame& frame) override;
  can::Reception receive() override;
  bool purge() override { return inner_.purge(); }
  void maintain(std::int64_t now_ns) override;
  bool is_open() const override { return inner_.is_open(); }
  int poll_fd() const override { return inner_.poll_fd(); }
  const can::BusCounters& counters() const override { return inner_.counters(); }

 private:
  struct Due {
    std::int64_t at_ns;
    can::Frame frame;
  };
  bool acting() const { return now_ns_ >= start_ns_; }
  bool deaf() const;

  can::Bus& inner_;
  std::uint8_t node_id_;
  FaultKind kind_ = FaultKind::off;
  std::int64_t start_ns_ = std::numeric_limits<std::int64_t>::max();
  std::mt19937_64 rng_;
  std::int64_t shift_ns_ = 0;
  std::int64_t now_ns_ = 0;
  std::int64_t pass_until_ns_ = 0, block_until_ns_ = 0;
  std::int64_t next_command_ns_ = 0;
  std::deque<Due> past_, due_;
  std::deque<can::Frame> for_drive_;
};

}  // namespace bevel::nodes
