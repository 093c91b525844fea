// SPDX-License-Identifier: MIT
// A bus inside one process, for tests and simulated time: deterministic, with the faults of a real one on request.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

class MemoryBus;

// The wire. Frames arrive at once, in the order sent. It must outlive the buses attached to it.
class MemoryNetwork {
 public:
  // Sees every frame about to go on the wire; may alter it; false loses it (the sender still gets its echo).
  using Tap = std::function<bool(Frame&)>;

  std::unique_ptr<MemoryBus> attach();

  void set_tap(Tap tap) { tap_ = std::move(tap); }
  void set_link_up(bool up);        // down: every participant loses what it had queued, and hears link_down
  void set_acknowledged(bool on);   // off: nobody acknowledges, frames stay in the senders' queues; on: they all go out
  void raise(BusEvent event);       // as if every controller had reported it
  void inject(const Frame& frame);  // from a participant that is not there

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

class MemoryBus : public Bus {
 public:
  static constexpr std::size_t kTransmitQueueFrames = 10;

  ~MemoryBus() override;

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  bool purge() override;
  void maintain(std::int64_t now_ns) override;
  bool is_open() const override { return open_; }
  int poll_fd() const override { return -1; }
  const BusCounters& counters() const override { return counters_; }

  std::size_t queued() const { return transmit_.size(); }

 private:
  friend class MemoryNetwork;
  // By MemoryNetwork::attach() alone: without a place on the wire it would hear nothing.
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
