// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// CAN bus inside one process, for tests and simulated time: deterministic, with the faults of a real bus on request.

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

class MemoryBus;

/// The wire. Frames arrive immediately, in the order sent. It must outlive the buses attached to it.
class MemoryNetwork {
 public:
  /// Receives each frame before it is on the wire, and may change it. If it returns false the frame is lost; the sender
  /// still receives its echo.
  using Tap = std::function<bool(Frame&)>;

  /// Adds a participant.
  /// @return its bus; this network must outlive it
  std::unique_ptr<MemoryBus> attach();

  /// Sets the function that sees each frame.
  /// @param tap function, or empty for none
  void set_tap(Tap tap) { tap_ = std::move(tap); }
  /// Sets the state of the link. If it goes down, each participant loses its queued frames and receives
  /// BusEvent::link_down.
  /// @param up true: frames are carried
  void set_link_up(bool up);
  /// Sets whether frames are acknowledged. While they are not, they stay in the queues of their senders; afterwards
  /// they are all sent.
  /// @param on true: frames are acknowledged
  void set_acknowledged(bool on);
  /// Reports an event to each participant, as its controller would.
  /// @param event event to report
  void raise(BusEvent event);
  /// Puts a frame on the wire that comes from none of the participants.
  /// @param frame frame to deliver
  void inject(const Frame& frame);

  /// @return true if the link is up
  bool link_up() const { return link_up_; }

 private:
  friend class MemoryBus;
  void deliver(const MemoryBus* sender, Frame frame);
  void detach(const MemoryBus* bus);

  std::vector<MemoryBus*> members_;
  Tap tap_;
  bool link_up_ = true;
  bool acknowledged_ = true;
};

/// One participant of a MemoryNetwork, created by MemoryNetwork::attach().
class MemoryBus : public Bus {
 public:
  static constexpr std::size_t kTransmitQueueFrames = 10;  ///< capacity of the transmit queue, frames

  ~MemoryBus() override;

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  bool purge() override;
  void maintain(std::int64_t now_ns) override;
  bool is_open() const override { return open_; }
  int poll_fd() const override { return -1; }
  const BusCounters& counters() const override { return counters_; }

  /// @return number of frames that are accepted and not yet on the wire
  std::size_t queued() const { return transmit_.size(); }

 private:
  friend class MemoryNetwork;
  // Only MemoryNetwork::attach() creates a bus, since a bus that is not attached receives nothing.
  explicit MemoryBus(MemoryNetwork& network) : network_(&network) {}
  void lose(BusEvent why);

  MemoryNetwork* network_;
  std::deque<Frame> transmit_;
  std::deque<Reception> receive_;
  BackOff back_off_;
  BusCounters counters_;
  bool open_ = true;
};

}  // namespace bevel::can
