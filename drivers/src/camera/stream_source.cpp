// SPDX-License-Identifier: MIT
// Frames over a Unix socket from the rig's frame server.
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include <bevel/drivers/camera/frame_sources.hpp>
#include <bevel/drivers/camera/frame_stream.hpp>

namespace bevel::camera {
namespace {

using Steady = std::chrono::steady_clock;

int connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(static_cast<char*>(address.sun_path), path.c_str(), path.size() + 1);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  // The socket API is written for this cast.
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  close(fd);
  return -1;
}

}  // namespace

StreamSource::StreamSource(const SourceConfig& config) : path_(config.path) {
  if (path_.size() >= sizeof(sockaddr_un::sun_path))
    throw SourceError("source path '" + path_ + "': " + std::to_string(path_.size()) + " characters, a socket allows " +
                      std::to_string(sizeof(sockaddr_un::sun_path) - 1));
  const auto deadline = Steady::now() + std::chrono::milliseconds(config.connect_timeout_ms);
  while ((socket_ = connect_to(path_)) < 0) {
    if (Steady::now() >= deadline)
      throw SourceError("source path '" + path_ + "': no frame server answers: " + std::strerror(errno));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

StreamSource::~StreamSource() {
  if (socket_ >= 0) close(socket_);
}

FrameResult StreamSource::fail(const std::string& text) {
  failed_ = true;
  return SourceFailure{"'" + path_ + "': " + text};
}

FrameResult StreamSource::next(std::chrono::milliseconds timeout) {
  if (failed_) return EndOfFrames{};
  const auto deadline = Steady::now() + timeout;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Steady::now());
    pollfd waiting{socket_, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::max<int64_t>(left.count(), 0)));
    if (ready < 0 && errno != EINTR) return fail(std::strerror(errno));
    if (ready <= 0) {
      if (Steady::now() >= deadline) return FrameTimeout{};
      continue;
    }
    const bool in_body = head_.size() == FrameHeader::kBytes;
    std::array<unsigned char, FrameHeader::kBytes> chunk{};
    unsigned char* into = in_body ? frame_.gray.data + body_received_ : chunk.data();
    const size_t want = in_body ? frame_.gray.total() - body_received_ : FrameHeader::kBytes - head_.size();
    const ssize_t got = recv(socket_, into, want, MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    // A server that goes before it has accepted us resets the connection; that is an end like any other.
    const bool closed = got == 0 || (got < 0 && errno == ECONNRESET);
    if (got < 0 && !closed) return fail(std::strerror(errno));
    if (closed) {
      failed_ = true;
      if (head_.empty()) return EndOfFrames{};
      return SourceFailure{"'" + path_ + "': the server closed in the middle of a frame"};
    }
    const auto received = static_cast<size_t>(got);
    if (!in_body) {
      head_.insert(head_.end(), chunk.begin(), chunk.begin() + got);
      if (head_.size() < FrameHeader::kBytes) continue;
      HeaderBytes bytes{};
      std::memcpy(bytes.data(), head_.data(), bytes.size());
      const FrameHeader header = decode(bytes);
      if (const auto reason = why_unusable(header)) return fail(*reason);
      frame_ = Frame{header.capture_utime, header.seq, header.camera,
                     cv::Mat(static_cast<int>(header.height_px), static_cast<int>(header.width_px), CV_8UC1)};
      body_received_ = 0;
      continue;
    }
    body_received_ += received;
    if (body_received_ == frame_.gray.total()) {
      head_.clear();
      return std::exchange(frame_, Frame{});
    }
  }
}

}  // namespace bevel::camera
