// A CAN bus without CAN: frames over a Unix socket (SOCK_SEQPACKET) between the processes of one machine, for machines
// whose kernel has no SocketCAN. A hub, run by the rig, passes each frame to all other clients and echoes it to its
// sender.
#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/can/bus.hpp"

namespace bevel::can {

class LocalBus : public Bus {
 public:
  // path: of the hub's socket. A hub that is not there yet is waited for.
  // Throws std::runtime_error when the path is empty or too long for a socket address (107 characters).
  LocalBus(std::string path, std::span<const std::uint32_t> listen);
  ~LocalBus() override;

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  bool purge() override;  // leaves and joins again; what the hub had already taken in still goes out, so false
  void maintain(std::int64_t now_ns) override;
  bool is_open() const override { return fd_ >= 0; }
  int poll_fd() const override { return fd_; }
  const BusCounters& counters() const override { return counters_; }

 private:
  bool open();
  void close();
  void lose();
  bool hears(std::uint32_t id) const;

  std::string path_;
  std::vector<std::uint32_t> listen_;
  int fd_ = -1;
  BackOff back_off_;
  BusCounters counters_;
  bool event_pending_ = false;
  BusEvent pending_ = BusEvent::gone;
};

class LocalHub {
 public:
  // Binds the socket. A path left by a hub that died is taken over; throws std::runtime_error when another hub serves
  // it.
  explicit LocalHub(std::string path);
  ~LocalHub();
  LocalHub(const LocalHub&) = delete;
  LocalHub& operator=(const LocalHub&) = delete;

  void service();                         // passes on all that waits; never blocks
  void run(const std::stop_token& stop);  // service() until asked to stop: the body of a thread
  int poll_fd() const { return epoll_fd_; }
  std::size_t clients() const { return clients_.size(); }
  std::uint64_t dropped() const { return dropped_; }  // frames for clients that do not read

 private:
  void accept_all();
  void pass_on_from(int client);
  void drop(int client);

  std::string path_;
  int listen_fd_ = -1;
  int epoll_fd_ = -1;
  std::vector<int> clients_;
  std::uint64_t dropped_ = 0;
};

}  // namespace bevel::can
