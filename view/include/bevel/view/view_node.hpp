// SPDX-License-Identifier: MIT
// The live page wired to LCM: subscribes to every channel of the loop and publishes nothing.
#pragma once

#include <lcm/lcm-cpp.hpp>
#include <mutex>

#include <bevel/nodes/lcm_port.hpp>
#include <bevel/view/live_view.hpp>
#include <bevel/view/page_server.hpp>

namespace bevel::view {

class ViewNode {
 public:
  /// @param lcm  must be good and outlive the node
  /// @param socket  of PageServer::open_port()
  /// @param hosts  further names by which the page may be requested, in lower case
  ViewNode(lcm::LCM& lcm, int socket, std::vector<std::string> hosts = {});
  ~ViewNode();
  ViewNode(const ViewNode&) = delete;
  ViewNode& operator=(const ViewNode&) = delete;

  void tell_time(const nodes::Now& now) { port_.tell_time(now); }
  // Publishes a snapshot; the rate of the page is that of these calls.
  void step(const nodes::Now& now);
  std::string address() const { return server_.address(); }

 private:
  template <class Message>
  void watch(const char* channel);
  void on_config(const lcm::ReceiveBuffer* buffer, const std::string& channel);
  Moment moment() const { return {port_.now().ns, port_.now().utime}; }

  lcm::LCM& lcm_;
  lcm::Subscription* config_ = nullptr;
  std::mutex mutex_;  // of the picture, which the server's threads read for its history
  LiveView picture_;
  nodes::LcmPort port_;
  PageServer server_;
};

}  // namespace bevel::view
