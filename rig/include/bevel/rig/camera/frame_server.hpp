// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Server of frames for any number of clients over a UNIX socket, in the format of
/// bevel/drivers/camera/frame_stream.hpp.
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <bevel/drivers/camera/frame.hpp>
#include <bevel/drivers/socket_file.hpp>

namespace bevel::rig {

/// Sends frames to its clients. publish() only copies the image and returns; a thread writes. A client that reads
/// slowly loses frames (their seq shows the gap) without an effect on other clients.
class FrameServer {
 public:
  /// Binds the socket. A socket file whose server has ended is replaced.
  /// @param socket_path path of the socket
  /// @throws IoError if \p socket_path is too long or names a file that is no socket, if another process
  ///   serves it, or if it cannot be bound
  explicit FrameServer(const std::string& socket_path);
  ~FrameServer();
  FrameServer(const FrameServer&) = delete;
  FrameServer& operator=(const FrameServer&) = delete;

  /// Sends a frame to all clients.
  /// @param frame frame
  /// @throws ArgumentError unless frame.gray is CV_8UC1 and of an allowed size
  void publish(const camera::Frame& frame);

  /// @return number of frames lost, summed over the clients
  int64_t dropped() const { return dropped_; }
  /// @return number of connected clients
  int clients() const { return clients_; }

 private:
  using Packet = std::shared_ptr<const std::vector<unsigned char>>;
  struct Client {
    int socket = -1;
    std::vector<Packet> waiting;  // the first is being sent
    size_t sent_bytes = 0;
  };

  void run();
  void accept_client();
  bool send_some(Client& client);
  void wake() const;

  std::unique_ptr<SocketFile> file_;
  int listener_ = -1;
  int wake_ = -1;
  std::mutex mutex_;  // guards clients_list_
  std::vector<Client> clients_list_;
  std::atomic<int64_t> dropped_{0};
  std::atomic<int> clients_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace bevel::rig
