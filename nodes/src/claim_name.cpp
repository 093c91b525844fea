// SPDX-License-Identifier: MIT
#include <bevel/nodes/claim_name.hpp>

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <bevel/error.hpp>
#include <bevel/nodes/lcm_port.hpp>
#include <bevel/nodes/runtime.hpp>

namespace bevel::nodes {
namespace {

constexpr double kListen_s = 0.6;  // longer than a process is silent on PROCESS_STATUS

void claim_on_this_machine(const std::string& lcm_url, const std::string& name) {
  // An abstract socket lives in the network namespace and goes with the process, even after kill -9.
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw IoError(std::string("cannot make a socket: ") + std::strerror(errno));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::string path = "bevel/" + name + (lcm_url.empty() ? "" : "/" + lcm_url);
  path.resize(std::min(path.size(), sizeof address.sun_path - 1));
  std::memcpy(address.sun_path + 1, path.data(), path.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + path.size());
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), size) != 0)
    throw IoError("another " + name + " is running here; two would fight over the needle");
  // Not closed: held for the life of the process.
}

void claim_on_the_network(lcm::LCM& lcm, const std::string& name) {
  bool heard = false;
  {
    LcmPort port(lcm);
    port.subscribe<process_status_t>(io::channel::kProcessStatus,
                                     [&](const process_status_t& m) { heard = heard || m.process == name; });
    run_to_end(lcm, {0.02, {}, [&](const Now&, double) { return !heard && !stop_requested(); }}, kListen_s);
  }
  if (heard) throw IoError("another " + name + " is heard on this network; two would fight over the needle");
}

void refuse_second_operator(lcm::LCM& lcm) {
  bool heard = false;
  {
    LcmPort port(lcm);
    port.subscribe<operator_heartbeat_t>(io::channel::kOperatorHeartbeat,
                                         [&heard](const operator_heartbeat_t&) { heard = true; });
    run_to_end(lcm, {0.02, {}, [&](const Now&, double) { return !heard && !stop_requested(); }}, kListen_s);
  }
  if (heard)
    throw IoError(
        "another operator program sends OPERATOR_HEARTBEAT on this network; end it first: one program operates the "
        "needle");
}

}  // namespace

void claim_operator(lcm::LCM& lcm, const std::string& lcm_url, const std::string& name) {
  claim_on_this_machine(lcm_url, name);
  refuse_second_operator(lcm);
}

void claim_name(lcm::LCM& lcm, const std::string& lcm_url, const std::string& name) {
  claim_on_this_machine(lcm_url, name);
  claim_on_the_network(lcm, name);
}

}  // namespace bevel::nodes
