// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Reception of several datagrams in one system call.

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>

namespace bevel::can {

/// Reads the datagrams of a socket, up to 16 in one system call. About ten frames arrive in each cycle; one call for
/// each would delay a command that has just arrived.
template <class Datagram>
class ReadAhead {
 public:
  /// One received datagram.
  struct Message {
    Datagram data{};       ///< payload
    std::size_t size = 0;  ///< size as sent, bytes; larger than Datagram if the datagram was truncated
    /// Ancillary data of one std::uint32_t.
    alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t))> control{};
    msghdr header{};  ///< header, with flags and ancillary data
  };

  ReadAhead() = default;
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// Returns the next datagram. Never blocks.
  /// @param fd socket to read from
  /// @return the datagram, valid until the next call; null with errno EAGAIN if none is queued, null with another errno
  /// if
  ///   the socket failed
  Message* next(int fd) {
    if (next_ == fetched_ && !fetch(fd)) return nullptr;
    return &messages_.at(next_++);
  }
  /// Discards the datagrams that were read from a socket that is closed now.
  void forget() { next_ = fetched_ = 0; }

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
