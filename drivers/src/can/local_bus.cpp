// SPDX-License-Identifier: MIT
#include <bevel/drivers/can/local_bus.hpp>

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include <bevel/drivers/can/local_wire.hpp>
#include <bevel/error.hpp>

namespace bevel::can {
namespace wire {

Packet encode(const Frame& frame) {
  Packet packet{};
  for (unsigned i = 0; i < 4; ++i) packet[i] = static_cast<std::uint8_t>(frame.id >> (8 * i));
  packet[4] = frame.size;
  std::copy(frame.data.begin(), frame.data.end(), packet.begin() + 8);
  return packet;
}

std::optional<Frame> decode(std::span<const std::uint8_t> packet) {
  if (packet.size() != std::tuple_size_v<Packet> || packet[4] > 8) return std::nullopt;
  Frame frame;
  for (unsigned i = 0; i < 4; ++i) frame.id |= static_cast<std::uint32_t>(packet[i]) << (8 * i);
  if (frame.id > kMaxId) return std::nullopt;
  frame.size = packet[4];
  std::copy_n(packet.begin() + 8, frame.size, frame.data.begin());
  return frame;
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw DeviceError("local bus '" + path + "': a path has 1 to " + std::to_string(sizeof address.sun_path - 1) +
                      " characters");
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), std::begin(address.sun_path));
  return address;
}

}  // namespace wire

namespace {
// Room for some twenty frames: enough for one cycle, too little to store old commands.
constexpr int kSendBufferBytes = 8192;
}  // namespace

LocalBus::LocalBus(std::string path, std::span<const std::uint32_t> listen)
    : path_(std::move(path)), listen_(listen.begin(), listen.end()) {
  (void)wire::address_of(path_);
  open();
}

bool LocalBus::open() {
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return false;
  (void)setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  const sockaddr_un address = wire::address_of(path_);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(fd);
    return false;
  }
  fd_ = fd;
  arrived_.forget();
  return true;
}

bool LocalBus::hears(std::uint32_t id) const {
  return listen_.empty() || std::find(listen_.begin(), listen_.end(), id) != listen_.end();
}

SendResult LocalBus::send(const Frame& frame) {
  if (fd_ < 0) return SendResult::gone;
  const auto packet = wire::encode(frame);
  if (::send(fd_, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(packet.size())) {
    ++counters_.sent;
    return SendResult::sent;
  }
  if (errno == EAGAIN || errno == ENOBUFS || errno == EINTR) {
    ++counters_.queue_full;
    return SendResult::queue_full;
  }
  lose(BusEvent::gone);
  return SendResult::gone;
}

Reception LocalBus::receive() {
  while (fd_ >= 0 && !has_event()) {
    const auto* arrived = arrived_.next(fd_);
    if (arrived == nullptr && errno == EAGAIN) return {};
    if (arrived == nullptr || arrived->size == 0) {
      lose(BusEvent::gone);
      break;
    }
    const auto frame = arrived->size == arrived->data.size() ? wire::decode(arrived->data) : std::nullopt;
    if (!frame) {
      ++counters_.malformed;
      continue;
    }
    if (!hears(frame->id)) continue;
    if ((arrived->data[wire::kFlagsAt] & wire::kEcho) != 0) return {Reception::Kind::echo, *frame, {}};
    ++counters_.received;
    return {Reception::Kind::frame, *frame, {}};
  }
  return take_event();
}

bool LocalBus::purge() {
  close();
  return false;
}

}  // namespace bevel::can
