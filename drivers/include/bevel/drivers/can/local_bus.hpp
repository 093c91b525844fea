// SPDX-License-Identifier: MIT
// A CAN bus without CAN: frames over a Unix socket (SOCK_SEQPACKET) between the processes of one machine, for machines
// whose kernel has no SocketCAN. A hub, run by the rig, passes each frame to all other clients and echoes it to its
// sender.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include <bevel/drivers/can/local_wire.hpp>
#include <bevel/drivers/can/read_ahead.hpp>
#include <bevel/drivers/can/socket_bus.hpp>
#include <bevel/drivers/socket_file.hpp>

namespace bevel::can {

class LocalBus final : public SocketBus {
 public:
  // path: of the hub's socket. A hub that is not there yet is waited for.
  // Throws DeviceError when the path is empty or too long for a socket address (107 characters).
  LocalBus(std::string path, std::span<const std::uint32_t> listen);

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  bool purge() override;  // leaves and joins again; what the hub had already taken in still goes out, so false

 private:
  bool open() override;
  bool hears(std::uint32_t id) const;

  std::string path_;
  std::vector<std::uint32_t> listen_;
  ReadAhead<wire::Packet> arrived_;
};

class LocalHub {
 public:
  /// Binds the socket; a socket file whose hub has ended is replaced.
  /// @throws DeviceError if another process serves the path, or if the path names a file that is no socket
  explicit LocalHub(const std::string& path);
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

  std::unique_ptr<SocketFile> file_;
  int listen_fd_ = -1;
  int epoll_fd_ = -1;
  std::vector<int> clients_;
  std::uint64_t dropped_ = 0;
};

}  // namespace bevel::can
