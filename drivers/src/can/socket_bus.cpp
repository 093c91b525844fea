// SPDX-License-Identifier: MIT
#include <bevel/drivers/can/socket_bus.hpp>

#include <unistd.h>

#include <utility>

namespace bevel::can {

void SocketBus::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

void SocketBus::lose(BusEvent why) {
  close();
  tell(why);
}

Reception SocketBus::take_event() {
  const auto event = std::exchange(event_, std::nullopt);
  return event ? Reception{Reception::Kind::event, {}, *event} : Reception{};
}

void SocketBus::maintain(std::int64_t now_ns) {
  if (fd_ >= 0 || !back_off_.due(now_ns)) return;
  if (!open()) {
    back_off_.failed(now_ns);
    return;
  }
  back_off_.succeeded();
  ++counters_.reopens;
  tell(BusEvent::reopened);
}

}  // namespace bevel::can
