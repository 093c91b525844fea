// SPDX-License-Identifier: MIT
// The port between everything that speaks CAN and whatever carries the frames: SocketCAN, the rig's local bus, or
// memory.
//
// No call blocks, and none throws after construction: trouble is a result or an event. A Bus is used from one thread.
// send() == sent means accepted, not delivered: a controller that nobody acknowledges keeps frames and sends them when
// the bus returns. That is why every accepted frame comes back as an echo once it is on the wire, and why purge()
// exists.
#pragma once

#include <cstdint>
#include <span>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::can {

enum class SendResult : std::uint8_t {
  sent,        // accepted by the queue; the echo says when it is on the wire
  queue_full,  // not accepted (ENOBUFS, EAGAIN): dropped and counted
  link_down,   // the interface is down
  gone,        // the interface, or the hub at the other end, does not exist any more
};

enum class BusEvent : std::uint8_t {
  error_passive,  // the controller sees too many errors: probably nobody acknowledges
  bus_off,        // the controller left the bus
  recovered,      // back to error-active
  link_down,
  gone,
  reopened,  // usable again after link_down, gone or purge(); queued frames of before are lost
  overflow,  // received frames were lost because nobody fetched them
};

// What receive() found.
struct Reception {
  enum class Kind : std::uint8_t {
    nothing,  // nothing waits
    frame,    // from another participant
    echo,     // a frame of one's own, now on the wire
    event,
  };
  Kind kind = Kind::nothing;
  Frame frame{};                             // frame, echo
  BusEvent event = BusEvent::error_passive;  // event
};

struct BusCounters {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;    // frames of others
  std::uint64_t queue_full = 0;  // frames refused by the queue
  std::uint64_t error_frames = 0;
  std::uint64_t overflows = 0;  // received frames lost in the receive queue
  std::uint64_t malformed = 0;  // not a standard data frame of at most 8 bytes
  std::uint64_t reopens = 0;
};

class Bus {
 public:
  Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;
  virtual ~Bus() = default;

  virtual SendResult send(const Frame& frame) = 0;
  virtual Reception receive() = 0;

  // Discards what was accepted but is not yet on the wire, so that old commands never reach a drive. The bus may be
  // closed afterwards until maintain() has reopened it. False: not permitted here, old frames may still go out.
  virtual bool purge() = 0;

  // Reopens a lost link, with a growing pause between attempts. Call it regularly. now_ns: any steady clock.
  virtual void maintain(std::int64_t now_ns) = 0;

  virtual bool is_open() const = 0;
  virtual int poll_fd() const = 0;  // readable when receive() has something; -1 while closed or where there is none
  virtual const BusCounters& counters() const = 0;
};

// Pauses between attempts to reopen: doubling, 20 ms to 1 s. Pure, shared by the adapters.
class BackOff {
 public:
  bool due(std::int64_t now_ns) const { return now_ns >= next_ns_; }
  void failed(std::int64_t now_ns) {
    next_ns_ = now_ns + pause_ns_;
    pause_ns_ = pause_ns_ < kLongest_ns / 2 ? pause_ns_ * 2 : kLongest_ns;
  }
  void succeeded() { *this = BackOff{}; }

 private:
  static constexpr std::int64_t kShortest_ns = 20'000'000;
  static constexpr std::int64_t kLongest_ns = 1'000'000'000;
  std::int64_t pause_ns_ = kShortest_ns;
  std::int64_t next_ns_ = INT64_MIN;
};

}  // namespace bevel::can
