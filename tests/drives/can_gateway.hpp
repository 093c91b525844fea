// SPDX-License-Identifier: MIT
// The kernel's CAN gateway (can-gw): which frames of one interface it sends on to another, said and asked over netlink
// in the terms of linux/can/gw.h, so that no program is needed for it. A rule takes the frames of one filter; what no
// rule takes is dropped. Rules go with their interfaces.
#pragma once

#include <linux/can/gw.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::test {

class CanGateway {
 public:
  CanGateway() : socket_(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE)) {
    const timeval limit{2, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  ~CanGateway() { ::close(socket_); }
  CanGateway(const CanGateway&) = delete;
  CanGateway& operator=(const CanGateway&) = delete;

  struct Rule {
    std::string from, to;
    std::uint32_t id = 0, mask = 0;  // takes (frame's id & mask) == id; with CAN_INV_FILTER in id, all others
  };
  // Status 0, or the kernel's errno.
  int add(const Rule& rule) { return change(RTM_NEWROUTE, NLM_F_CREATE, rule); }
  int remove(const Rule& rule) { return change(RTM_DELROUTE, 0, rule); }

  // Over all rules between the two: frames sent on, and frames that a rule took but whose interface was not up.
  struct Counters {
    std::uint32_t rules = 0, handled = 0, dropped = 0;
  };
  std::optional<Counters> counters(const std::string& from, const std::string& to) {
    Request request(RTM_GETROUTE, NLM_F_DUMP);
    if (!request.send(socket_)) return std::nullopt;
    Counters sum;
    std::array<char, 16384> answer{};
    for (;;) {
      const ssize_t size = ::recv(socket_, answer.data(), answer.size(), 0);
      if (size <= 0) return std::nullopt;
      auto left = static_cast<unsigned>(size);
      for (auto* head = reinterpret_cast<nlmsghdr*>(answer.data()); NLMSG_OK(head, left);
           head = NLMSG_NEXT(head, left)) {
        if (head->nlmsg_type == NLMSG_ERROR) return std::nullopt;
        if (head->nlmsg_type == NLMSG_DONE) return sum;
        add_rule(*head, ::if_nametoindex(from.c_str()), ::if_nametoindex(to.c_str()), sum);
      }
    }
  }

 private:
  struct Request {
    Request(int type, int flags) {
      head.nlmsg_len = NLMSG_LENGTH(sizeof(rtcanmsg));
      head.nlmsg_type = static_cast<std::uint16_t>(type);
      head.nlmsg_flags = static_cast<std::uint16_t>(NLM_F_REQUEST | flags);
      // Echoed at the far interface, so that the sockets there hear it, as frames of their own neighbours.
      rule = {AF_CAN, CGW_TYPE_CAN_CAN, CGW_FLAGS_CAN_ECHO};
    }
    template <typename T>
    void attribute(int type, const T& value) {
      auto* at = reinterpret_cast<rtattr*>(reinterpret_cast<char*>(this) + NLMSG_ALIGN(head.nlmsg_len));
      at->rta_type = static_cast<std::uint16_t>(type);
      at->rta_len = RTA_LENGTH(sizeof value);
      std::memcpy(RTA_DATA(at), &value, sizeof value);
      head.nlmsg_len = NLMSG_ALIGN(head.nlmsg_len) + at->rta_len;
    }
    bool send(int socket) const {
      return ::send(socket, this, head.nlmsg_len, 0) == static_cast<ssize_t>(head.nlmsg_len);
    }

    nlmsghdr head{};
    rtcanmsg rule{};
    std::array<char, 128> attributes{};
  };

  int change(int type, int flags, const Rule& rule) {
    Request request(type, NLM_F_ACK | flags);
    request.attribute(CGW_SRC_IF, ::if_nametoindex(rule.from.c_str()));
    request.attribute(CGW_DST_IF, ::if_nametoindex(rule.to.c_str()));
    request.attribute(CGW_FILTER, can_filter{rule.id, rule.mask});
    if (!request.send(socket_)) return errno;
    std::array<char, 1024> answer{};
    if (::recv(socket_, answer.data(), answer.size(), 0) <= 0) return errno;
    const auto* head = reinterpret_cast<const nlmsghdr*>(answer.data());
    if (head->nlmsg_type != NLMSG_ERROR) return EPROTO;
    return -reinterpret_cast<const nlmsgerr*>(answer.data() + NLMSG_HDRLEN)->error;
  }

  static void add_rule(nlmsghdr& head, std::uint32_t from, std::uint32_t to, Counters& sum) {
    std::array<std::uint32_t, CGW_MAX + 1> value{};
    auto left = static_cast<unsigned>(head.nlmsg_len - NLMSG_LENGTH(sizeof(rtcanmsg)));
    auto* at = reinterpret_cast<rtattr*>(reinterpret_cast<char*>(&head) + NLMSG_SPACE(sizeof(rtcanmsg)));
    for (; RTA_OK(at, left); at = RTA_NEXT(at, left))
      if (at->rta_type < value.size() && RTA_PAYLOAD(at) == sizeof(std::uint32_t))
        std::memcpy(&value.at(at->rta_type), RTA_DATA(at), sizeof(std::uint32_t));
    if (value[CGW_SRC_IF] != from || value[CGW_DST_IF] != to) return;
    ++sum.rules;
    sum.handled += value[CGW_HANDLED];
    sum.dropped += value[CGW_DROPPED];
  }

  int socket_;
};

}  // namespace bevel::test
