// SPDX-License-Identifier: MIT
// Datagrams of a socket, fetched several in one system call: in each cycle some ten frames wait, and a command that has
// just come must not stand behind a call for each of them.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>

namespace bevel::can {

template <class Datagram>
class ReadAhead {
 public:
  struct Message {
    Datagram data{};
    std::size_t size = 0;  // as sent: larger than Datagram where it was cut
    alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t))> control{};
    msghdr header{};
  };

  ReadAhead() = default;
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  // The next one; null where none waits (errno is EAGAIN then) or the socket failed (errno). Never blocks.
  Message* next(int fd) {
    if (next_ == fetched_ && !fetch(fd)) return nullptr;
    return &messages_.at(next_++);
  }
  void forget() { next_ = fetched_ = 0; }  // what was fetched from a socket that is closed

 private:
  static constexpr std::size_t kAtOnce = 16;

  bool fetch(int fd) {
    std::array<mmsghdr, kAtOnce> headers{};
    std::array<iovec, kAtOnce> parts{};
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      Message& m = messages_.at(i);
      parts.at(i) = {&m.data, sizeof m.data};
      msghdr& h = headers.at(i).msg_hdr;
      h.msg_iov = &parts.at(i);
      h.msg_iovlen = 1;
      h.msg_control = m.control.data();
      h.msg_controllen = m.control.size();
    }
    int got = -1;
    do got = recvmmsg(fd, headers.data(), headers.size(), MSG_DONTWAIT | MSG_TRUNC, nullptr);
    while (got < 0 && errno == EINTR);
    forget();
    if (got <= 0) return false;
    fetched_ = static_cast<std::size_t>(got);
    for (std::size_t i = 0; i < fetched_; ++i) {
      Message& m = messages_.at(i);
      m.header = headers.at(i).msg_hdr;
      m.size = headers.at(i).msg_len;
    }
    return true;
  }

  std::array<Message, kAtOnce> messages_{};
  std::size_t next_ = 0, fetched_ = 0;
};

}  // namespace bevel::can
