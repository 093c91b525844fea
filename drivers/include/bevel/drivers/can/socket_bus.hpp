// SPDX-License-Identifier: MIT
// What buses over a socket share: it is opened again after a loss, and each loss or return is told once.
#pragma once

#include <optional>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

class SocketBus : public Bus {
 public:
  ~SocketBus() override { close(); }
  SocketBus(const SocketBus&) = delete;
  SocketBus& operator=(const SocketBus&) = delete;

  void maintain(std::int64_t now_ns) override;
  bool is_open() const override { return fd_ >= 0; }
  int poll_fd() const override { return fd_; }
  const BusCounters& counters() const override { return counters_; }

 protected:
  SocketBus() = default;
  virtual bool open() = 0;  // sets fd_
  void close();
  void lose(BusEvent why);  // closes, and tells why
  void tell(BusEvent event) { event_ = event; }
  bool has_event() const { return event_.has_value(); }
  Reception take_event();  // nothing if none waits

  int fd_ = -1;
  BusCounters counters_;

 private:
  BackOff back_off_;
  std::optional<BusEvent> event_;
};

}  // namespace bevel::can
