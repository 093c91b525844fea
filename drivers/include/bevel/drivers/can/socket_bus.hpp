// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Common part of the buses over a socket: reopening after a loss, and one event for each loss or return.

#include <optional>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

/// Base class of the buses over a socket.
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
  /// Opens the socket and sets fd_.
  /// @return true if the socket is open
  virtual bool open() = 0;
  /// Closes the socket.
  void close();
  /// Closes the socket and queues an event.
  /// @param why event to report
  void lose(BusEvent why);
  /// Queues an event; one that is queued already is replaced.
  /// @param event event to report
  void tell(BusEvent event) { event_ = event; }
  /// @return true if an event is queued
  bool has_event() const { return event_.has_value(); }
  /// Takes the queued event.
  /// @return the event; Reception::Kind::nothing if none is queued
  Reception take_event();

  int fd_ = -1;           ///< socket; -1 while closed
  BusCounters counters_;  ///< counters since construction

 private:
  BackOff back_off_;
  std::optional<BusEvent> event_;
};

}  // namespace bevel::can
