// SPDX-License-Identifier: MIT
#include <bevel/drivers/can/open_bus.hpp>

#include <bevel/drivers/can/local_bus.hpp>
#include "can/socketcan_bus.hpp"

namespace bevel::can {

std::unique_ptr<Bus> open_bus(const std::string& address, std::span<const std::uint32_t> listen) {
  static const std::string kLocal = "unix:";
  if (address.rfind(kLocal, 0) == 0) return std::make_unique<LocalBus>(address.substr(kLocal.size()), listen);
  return std::make_unique<SocketCanBus>(address, listen);
}

}  // namespace bevel::can
