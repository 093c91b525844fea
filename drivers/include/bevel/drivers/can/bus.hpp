// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Interface of a CAN bus. Implementations: SocketCAN, the local bus over a UNIX socket, and a bus in memory.

#include <cstdint>
#include <span>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::can {

/// Result of Bus::send().
enum class SendResult : std::uint8_t {
  sent,        ///< accepted by the queue; the echo reports when it is on the wire
  queue_full,  ///< not accepted (ENOBUFS, EAGAIN): dropped and counted
  link_down,   ///< the interface is down
  gone,        ///< the interface, or the hub at the other end, does not exist any more
};

/// Changes of the state of a bus, reported once each by Bus::receive().
enum class BusEvent : std::uint8_t {
  error_passive,  ///< the controller counts too many errors: probably no participant acknowledges
  bus_off,        ///< the controller left the bus
  recovered,      ///< back to error-active
  link_down,      ///< the interface is down
  gone,           ///< the interface, or the hub at the other end, does not exist any more
  reopened,       ///< usable again after link_down, gone or purge(); frames queued before are lost
  overflow,       ///< received frames were lost because the receive queue was full
};

/// Result of Bus::receive().
struct Reception {
  /// Kind of the result.
  enum class Kind : std::uint8_t {
    nothing,  ///< nothing is queued
    frame,    ///< a frame from another participant
    echo,     ///< a frame of this participant that is now on the wire
    event,    ///< a change of the state of the bus
  };
  Kind kind = Kind::nothing;                 ///< kind of the result
  Frame frame{};                             ///< valid if kind is `frame` or `echo`
  BusEvent event = BusEvent::error_passive;  ///< valid if kind is `event`
};

/// Counters of a bus since its construction.
struct BusCounters {
  std::uint64_t sent = 0;          ///< frames accepted by send()
  std::uint64_t received = 0;      ///< frames of other participants
  std::uint64_t queue_full = 0;    ///< frames rejected by the transmit queue
  std::uint64_t error_frames = 0;  ///< error frames of the controller
  std::uint64_t overflows = 0;     ///< received frames lost in the receive queue
  std::uint64_t malformed = 0;     ///< not a standard data frame of at most 8 bytes
  std::uint64_t reopens = 0;       ///< successful attempts to reopen the link
};

/// Sends and receives CAN frames without blocking.
///
/// No function throws after construction: an error is a result or an event. A Bus is used from one thread.
/// SendResult::sent means accepted, not delivered. A controller whose frames are not acknowledged keeps them and sends
/// them when the bus returns. Therefore each accepted frame comes back as an echo once it is on the wire, and purge()
/// discards frames that are not.
class Bus {
 public:
  Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;
  virtual ~Bus() = default;

  /// Queues a frame for transmission.
  /// @param frame frame with an 11-bit identifier and at most 8 bytes
  /// @return whether the frame was accepted; a frame that was not accepted is dropped
  virtual SendResult send(const Frame& frame) = 0;
  /// Returns the oldest frame, echo or event that is queued.
  /// @return Reception::Kind::nothing if the queue is empty
  virtual Reception receive() = 0;

  /// Discards frames that were accepted but are not yet on the wire, so that old commands never reach a drive. The bus
  /// may be closed afterwards until maintain() has reopened it.
  /// @return false if frames cannot be discarded: old frames may still be sent
  virtual bool purge() = 0;

  /// Reopens a lost link, with a growing pause between attempts (BackOff). Call it regularly.
  /// @param now_ns time of a steady clock, ns
  virtual void maintain(std::int64_t now_ns) = 0;

  /// @return true if the link is open
  virtual bool is_open() const = 0;
  /// @return file descriptor that is readable when receive() has a result; -1 while closed, or if the bus has none
  virtual int poll_fd() const = 0;
  /// @return counters since construction
  virtual const BusCounters& counters() const = 0;
};

/// Computes when the next attempt to reopen a link is due. The pause doubles from 20 ms to 1 s. Shared by the adapters;
/// uses no clock.
class BackOff {
 public:
  /// Returns whether an attempt is due.
  /// @param now_ns time of a steady clock, ns
  /// @return true if the pause after the last failed attempt is over, or if no attempt failed
  bool due(std::int64_t now_ns) const { return now_ns >= next_ns_; }
  /// Doubles the pause after a failed attempt.
  /// @param now_ns time of the attempt, ns
  void failed(std::int64_t now_ns) {
    next_ns_ = now_ns + pause_ns_;
    pause_ns_ = pause_ns_ < kLongest_ns / 2 ? pause_ns_ * 2 : kLongest_ns;
  }
  /// Resets the pause to 20 ms.
  void succeeded() { *this = BackOff{}; }

 private:
  static constexpr std::int64_t kShortest_ns = 20'000'000;
  static constexpr std::int64_t kLongest_ns = 1'000'000'000;
  std::int64_t pause_ns_ = kShortest_ns;
  std::int64_t next_ns_ = INT64_MIN;
};

}  // namespace bevel::can
