// SPDX-License-Identifier: MIT
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <bevel/drivers/can/local_bus.hpp>
#include <bevel/drivers/can/local_wire.hpp>
#include <bevel/error.hpp>

namespace bevel::can {
namespace {

constexpr int kBacklog = 16;
constexpr int kRounds = 16;  // a bound, so that service() returns however much the clients talk
constexpr int kStopLatency_ms = 20;

IoError failure(const std::string& path, const std::string& what) {
  return IoError("local bus '" + path + "': " + what + " (" + std::strerror(errno) + ")");
}

void watch(int epoll_fd, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  (void)epoll_ctl(epoll_fd, EPOLL_CTL_ADD, fd, &event);
}

}  // namespace

LocalHub::LocalHub(const std::string& path) {
  const sockaddr_un address = wire::address_of(path);
  listen_fd_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listen_fd_ < 0) throw failure(path, "no socket");
  try {
    file_ = std::make_unique<SocketFile>(listen_fd_, address, "local bus '" + path + "'");
    epoll_fd_ = epoll_create1(EPOLL_CLOEXEC);
    if (epoll_fd_ < 0 || ::listen(listen_fd_, kBacklog) != 0) throw failure(path, "cannot be served");
  } catch (...) {
    ::close(listen_fd_);
    if (epoll_fd_ >= 0) ::close(epoll_fd_);
    throw;
  }
  watch(epoll_fd_, listen_fd_);
}

LocalHub::~LocalHub() {
  for (const int client : clients_) ::close(client);
  ::close(epoll_fd_);
  ::close(listen_fd_);
}

void LocalHub::accept_all() {
  for (;;) {
    const int client = ::accept4(listen_fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (client < 0) return;
    clients_.push_back(client);
    watch(epoll_fd_, client);
  }
}

void LocalHub::drop(int client) {
  std::erase(clients_, client);
  ::close(client);  // which also takes it out of the epoll set
}

void LocalHub::pass_on_from(int client) {
  // Bounded, so that one client that never stops talking does not keep the others waiting.
  for (int i = 0; i < 64; ++i) {
    wire::Packet packet{};
    const ssize_t got = ::recv(client, packet.data(), packet.size(), MSG_DONTWAIT | MSG_TRUNC);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) return drop(client);
    if (got != static_cast<ssize_t>(packet.size()) || !wire::decode(packet)) continue;
    for (const int to : clients_) {
      packet[wire::kFlagsAt] = to == client ? wire::kEcho : 0;
      if (::send(to, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0) ++dropped_;
    }
  }
}

void LocalHub::service() {
  std::array<epoll_event, 16> events{};
  for (int round = 0; round < kRounds; ++round) {
    const int ready = epoll_wait(epoll_fd_, events.data(), static_cast<int>(events.size()), 0);
    if (ready <= 0) return;
    for (int i = 0; i < ready; ++i) {
      const int fd = events.at(static_cast<std::size_t>(i)).data.fd;
      if (fd == listen_fd_) {
        accept_all();
      } else {
        pass_on_from(fd);
      }
    }
  }
}

void LocalHub::run(const std::stop_token& stop) {
  std::array<epoll_event, 1> event{};
  while (!stop.stop_requested()) {
    if (epoll_wait(epoll_fd_, event.data(), 1, kStopLatency_ms) > 0) service();
  }
}

}  // namespace bevel::can
