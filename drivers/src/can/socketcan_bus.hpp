// SPDX-License-Identifier: MIT
// Bus over a Linux SocketCAN interface (can0, vcan0, ...). See Documentation/networking/can.rst of the kernel.
#pragma once

#include <linux/can.h>

#include <string>
#include <vector>

#include <bevel/drivers/can/read_ahead.hpp>
#include <bevel/drivers/can/socket_bus.hpp>

namespace bevel::can {

class SocketCanBus final : public SocketBus {
 public:
  // interface: its name. listen: the identifiers to hear, own echoes included (exact kernel filters); empty: all.
  // Throws DeviceError only for a name that cannot be one and where the kernel has no CAN: an interface that is
  // missing or down is waited for.
  SocketCanBus(std::string interface, std::span<const std::uint32_t> listen);

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  bool purge() override;  // takes the link down and up: needs CAP_NET_ADMIN

 private:
  bool open() override;
  void note_overflow(msghdr& header);

  std::string interface_;
  std::vector<std::uint32_t> listen_;
  ReadAhead<can_frame> arrived_;
  std::uint32_t overflow_total_ = 0;  // SO_RXQ_OVFL counts since the socket was opened
};

}  // namespace bevel::can
