// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// CAN frames over a UNIX socket (SOCK_SEQPACKET) between the processes of one machine, for kernels without SocketCAN.

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

/// Client of a LocalHub.
class LocalBus final : public SocketBus {
 public:
  /// Connects to the hub. If the hub does not exist yet, maintain() connects later.
  /// @param path   path of the hub's socket, 1 to 107 characters
  /// @param listen identifiers to receive, own echoes included; empty: all
  /// @throws DeviceError if the path is empty or too long for a socket address
  LocalBus(std::string path, std::span<const std::uint32_t> listen);

  SendResult send(const Frame& frame) override;
  Reception receive() override;
  /// Closes the connection; maintain() opens it again. Frames that the hub has already read are still delivered.
  /// @return false always
  bool purge() override;

 private:
  bool open() override;
  bool hears(std::uint32_t id) const;

  std::string path_;
  std::vector<std::uint32_t> listen_;
  ReadAhead<wire::Packet> arrived_;
};

/// Passes each frame to all other clients and echoes it to its sender. The simulated rig runs it.
class LocalHub {
 public:
  /// Binds the socket. A socket file whose hub has ended is replaced.
  /// @param path path of the socket, 1 to 107 characters
  /// @throws DeviceError if the path is empty or too long for a socket address
  /// @throws IoError if another process serves the path, if the path names a file that is no socket, or if the socket
  ///   cannot be served
  explicit LocalHub(const std::string& path);
  ~LocalHub();
  LocalHub(const LocalHub&) = delete;
  LocalHub& operator=(const LocalHub&) = delete;

  /// Accepts clients and passes on the frames that have arrived. Never blocks.
  void service();
  /// Calls service() until a stop is requested: the body of a thread.
  /// @param stop token of the thread; checked at least every 20 ms
  void run(const std::stop_token& stop);
  /// @return file descriptor that is readable when service() has work
  int poll_fd() const { return epoll_fd_; }
  /// @return number of connected clients
  std::size_t clients() const { return clients_.size(); }
  /// @return number of frames lost because the receiving client does not read
  std::uint64_t dropped() const { return dropped_; }

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
