// SPDX-License-Identifier: MIT
#include "can/socketcan_bus.hpp"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include <bevel/error.hpp>

namespace bevel::can {
namespace {

// A queue of a few frames: what waits there is already old when it leaves.
constexpr int kTransmitQueueFrames = 10;

ifreq request_for(const std::string& interface) {
  ifreq request{};
  std::copy_n(interface.begin(), std::min<std::size_t>(interface.size(), IFNAMSIZ - 1), std::begin(request.ifr_name));
  return request;
}

std::optional<BusEvent> event_of(const can_frame& error) {
  if ((error.can_id & CAN_ERR_BUSOFF) != 0) return BusEvent::bus_off;
  if ((error.can_id & CAN_ERR_RESTARTED) != 0) return BusEvent::recovered;
  if ((error.can_id & CAN_ERR_CRTL) != 0) {
    if ((error.data[1] & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) return BusEvent::error_passive;
    if ((error.data[1] & CAN_ERR_CRTL_RX_OVERFLOW) != 0) return BusEvent::overflow;
    if ((error.data[1] & CAN_ERR_CRTL_ACTIVE) != 0) return BusEvent::recovered;
  }
  return std::nullopt;
}

template <typename T>
void set_option(int fd, int level, int name, const T& value) {
  // A kernel that lacks an option still carries frames; each option only adds knowledge.
  (void)setsockopt(fd, level, name, &value, sizeof value);
}

}  // namespace

SocketCanBus::SocketCanBus(std::string interface, std::span<const std::uint32_t> listen)
    : interface_(std::move(interface)), listen_(listen.begin(), listen.end()) {
  if (interface_.empty() || interface_.size() >= IFNAMSIZ)
    throw DeviceError("CAN interface '" + interface_ + "': a name has 1 to 15 characters");
  const int probe = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (probe < 0)
    throw DeviceError("CAN interface '" + interface_ + "': this kernel has no SocketCAN (" + std::strerror(errno) +
                      ")");
  ::close(probe);
  open();
}

bool SocketCanBus::open() {
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0) return false;
  ifreq request = request_for(interface_);
  const bool up = ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0;
  if (!up || ioctl(fd, SIOCGIFINDEX, &request) != 0) {
    ::close(fd);
    return false;
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;

  std::vector<can_filter> filters;
  for (const auto id : listen_) filters.push_back({id, CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_SFF_MASK});
  if (!filters.empty())
    (void)setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                     static_cast<socklen_t>(filters.size() * sizeof(can_filter)));
  set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, can_err_mask_t{CAN_ERR_MASK});
  set_option(fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, int{1});
  set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, int{1});

  request = request_for(interface_);
  request.ifr_qlen = kTransmitQueueFrames;
  (void)ioctl(fd, SIOCSIFTXQLEN, &request);  // refused without CAP_NET_ADMIN: then the administrator's length stays

  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(fd);
    return false;
  }
  fd_ = fd;
  overflow_total_ = 0;
  arrived_.forget();
  return true;
}

SendResult SocketCanBus::send(const Frame& frame) {
  if (fd_ < 0) return SendResult::link_down;
  can_frame raw{};
  raw.can_id = frame.id & CAN_SFF_MASK;
  raw.can_dlc = std::min<std::uint8_t>(frame.size, CAN_MAX_DLEN);
  std::copy_n(frame.data.begin(), raw.can_dlc, std::begin(raw.data));
  if (::send(fd_, &raw, sizeof raw, MSG_DONTWAIT) == static_cast<ssize_t>(sizeof raw)) {
    ++counters_.sent;
    return SendResult::sent;
  }
  switch (errno) {
    case ENETDOWN:
      lose(BusEvent::link_down);
      return SendResult::link_down;
    case ENODEV:
    case ENXIO:
      lose(BusEvent::gone);
      return SendResult::gone;
    default:  // ENOBUFS, EAGAIN, EINTR: not accepted, and not to be retried with what is old by then
      ++counters_.queue_full;
      return SendResult::queue_full;
  }
}

void SocketCanBus::note_overflow(msghdr& header) {
  for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
    std::uint32_t total = 0;
    std::memcpy(&total, CMSG_DATA(c), sizeof total);
    if (total == overflow_total_) continue;
    counters_.overflows += total - overflow_total_;
    overflow_total_ = total;
    tell(BusEvent::overflow);
  }
}

Reception SocketCanBus::receive() {
  if (has_event()) return take_event();
  while (fd_ >= 0) {
    auto* arrived = arrived_.next(fd_);
    if (arrived == nullptr) {
      if (errno != ENETDOWN && errno != ENODEV && errno != ENXIO) return {};
      lose(errno == ENETDOWN ? BusEvent::link_down : BusEvent::gone);
      return take_event();
    }
    note_overflow(arrived->header);
    const can_frame& raw = arrived->data;
    if ((raw.can_id & CAN_ERR_FLAG) != 0) {
      ++counters_.error_frames;
      if (const auto event = event_of(raw)) return {Reception::Kind::event, {}, *event};
      continue;
    }
    if (arrived->size != sizeof raw || (raw.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0 ||
        raw.can_dlc > CAN_MAX_DLEN) {
      ++counters_.malformed;
      continue;
    }
    Reception found;
    found.kind = (arrived->header.msg_flags & MSG_CONFIRM) != 0 ? Reception::Kind::echo : Reception::Kind::frame;
    found.frame.id = raw.can_id & CAN_SFF_MASK;
    found.frame.size = raw.can_dlc;
    std::copy_n(std::begin(raw.data), raw.can_dlc, found.frame.data.begin());
    if (found.kind == Reception::Kind::frame) ++counters_.received;
    return found;
  }
  return {};
}

bool SocketCanBus::purge() {
  // Only the interface going down empties the controller's and the queueing discipline's store: closing the socket does
  // not.
  close();
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0) return false;
  ifreq request = request_for(interface_);
  bool purged = ioctl(fd, SIOCGIFFLAGS, &request) == 0;
  if (purged && (request.ifr_flags & IFF_UP) != 0) {
    request.ifr_flags = static_cast<short>(request.ifr_flags & ~IFF_UP);
    purged = ioctl(fd, SIOCSIFFLAGS, &request) == 0;
    request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP);
    (void)ioctl(fd, SIOCSIFFLAGS, &request);
  }
  ::close(fd);
  return purged;
}

}  // namespace bevel::can
