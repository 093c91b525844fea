// SPDX-License-Identifier: MIT
#include <bevel/rig/camera/frame_server.hpp>

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <bevel/drivers/camera/frame_stream.hpp>
#include <bevel/error.hpp>

namespace bevel::rig {
namespace {

constexpr size_t kQueue = 3;  // frames a client may be behind

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw IoError("frame server path '" + path + "': allowed 1 to " + std::to_string(sizeof address.sun_path - 1) +
                  " characters");
  address.sun_family = AF_UNIX;
  std::memcpy(static_cast<char*>(address.sun_path), path.c_str(), path.size() + 1);
  return address;
}

}  // namespace

FrameServer::FrameServer(const std::string& socket_path) {
  const sockaddr_un address = address_of(socket_path);
  const std::string name = "frame server path '" + socket_path + "'";
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  try {
    if (listener_ < 0 || wake_ < 0) throw IoError(name + ": " + std::strerror(errno));
    file_ = std::make_unique<SocketFile>(listener_, address, name);
    if (listen(listener_, 8) != 0) throw IoError(name + ": " + std::strerror(errno));
  } catch (...) {
    if (listener_ >= 0) close(listener_);
    if (wake_ >= 0) close(wake_);
    throw;
  }
  thread_ = std::thread([this] { run(); });
}

FrameServer::~FrameServer() {
  stop_ = true;
  wake();
  thread_.join();
  for (const Client& client : clients_list_) close(client.socket);
  close(listener_);
  close(wake_);
}

void FrameServer::wake() const {
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
}

void FrameServer::publish(const camera::Frame& frame) {
  if (frame.gray.type() != CV_8UC1) throw ArgumentError("frame server: the picture is not 8-bit gray");
  camera::FrameHeader header;
  header.camera = frame.camera;
  header.width_px = static_cast<uint32_t>(frame.gray.cols);
  header.height_px = static_cast<uint32_t>(frame.gray.rows);
  header.payload_bytes = header.width_px * header.height_px;
  header.seq = frame.seq;
  header.capture_utime = frame.capture_utime;
  if (const auto reason = camera::why_unusable(header)) throw ArgumentError("frame server: " + *reason);
  auto packet = std::make_shared<std::vector<unsigned char>>(sizeof header + header.payload_bytes);
  const camera::HeaderBytes head = camera::encode(header);
  std::memcpy(packet->data(), head.data(), head.size());
  for (int row = 0; row < frame.gray.rows; ++row)
    std::memcpy(packet->data() + head.size() + static_cast<size_t>(row) * header.width_px, frame.gray.ptr(row),
                header.width_px);
  {
    const std::lock_guard lock(mutex_);
    for (Client& client : clients_list_) {
      if (client.waiting.size() < kQueue)
        client.waiting.push_back(packet);
      else
        ++dropped_;
    }
  }
  wake();
}

void FrameServer::accept_client() {
  const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return;
  const std::lock_guard lock(mutex_);
  clients_list_.push_back(Client{fd, {}, 0});
  clients_ = static_cast<int>(clients_list_.size());
}

/// False if the client is gone.
bool FrameServer::send_some(Client& client) {
  while (!client.waiting.empty()) {
    const std::vector<unsigned char>& bytes = *client.waiting.front();
    const ssize_t sent = send(client.socket, bytes.data() + client.sent_bytes, bytes.size() - client.sent_bytes,
                              MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) return errno == EAGAIN || errno == EINTR;
    client.sent_bytes += static_cast<size_t>(sent);
    if (client.sent_bytes < bytes.size()) continue;
    client.waiting.erase(client.waiting.begin());
    client.sent_bytes = 0;
  }
  return true;
}

void FrameServer::run() {
  std::vector<pollfd> watched;
  while (!stop_) {
    watched.assign({pollfd{listener_, POLLIN, 0}, pollfd{wake_, POLLIN, 0}});
    {
      const std::lock_guard lock(mutex_);
      for (const Client& client : clients_list_) {
        const bool more = !client.waiting.empty();
        watched.push_back(pollfd{client.socket, static_cast<short>(more ? POLLOUT : 0), 0});
      }
    }
    poll(watched.data(), watched.size(), 500);
    uint64_t count = 0;
    [[maybe_unused]] const ssize_t drained = read(wake_, &count, sizeof count);
    {
      const std::lock_guard lock(mutex_);
      for (size_t i = 0; i + 2 < watched.size(); ++i) {
        Client& client = clients_list_[i];
        const bool hung_up = (watched[i + 2].revents & (POLLERR | POLLHUP)) != 0;
        if (!hung_up && send_some(client)) continue;
        close(client.socket);
        client.socket = -1;
      }
      std::erase_if(clients_list_, [](const Client& client) { return client.socket < 0; });
      clients_ = static_cast<int>(clients_list_.size());
    }
    if ((watched[0].revents & POLLIN) != 0) accept_client();
  }
}

}  // namespace bevel::rig
