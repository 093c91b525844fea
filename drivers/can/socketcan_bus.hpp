// Bus over a Linux SocketCAN interface (can0, vcan0, ...). See Documentation/networking/can.rst of the kernel.
#pragma once

#include <string>
#include <vector>

#include "drivers/can/bus.hpp"

namespace bevel::can {

class SocketCanBus : public Bus {
 public:
  // interface: its name. listen: the identifiers to hear, own echoes included (exact kernel filters); empty: all.
  // Throws std::runtime_error only for a name that cannot be one and where the kernel has no CAN: an interface that is
  // missing or down is waited for.
  SocketCanBus(std::string interface, std::span<const std::uint32_t> listen);
  ~SocketCanBus() override;

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  bool purge() override;  // takes the link down and up: needs CAP_NET_ADMIN
  void maintain(std::int64_t now_ns) override;
  bool is_open() const override { return fd_ >= 0; }
  int poll_fd() const override { return fd_; }
  const BusCounters& counters() const override { return counters_; }

 private:
  bool open();
  void close();
  void lose(BusEvent why);

  std::string interface_;
  std::vector<std::uint32_t> listen_;
  int fd_ = -1;
  BackOff back_off_;
  BusCounters counters_;
  std::uint32_t overflow_total_ = 0;  // SO_RXQ_OVFL counts since the socket was opened
  bool event_pending_ = false;
  BusEvent pending_ = BusEvent::link_down;
};

}  // namespace bevel::can
