// SPDX-License-Identifier: MIT
// A participant whose line loses, doubles and delays what others send: a can::Bus round another one. What the
// participant itself sends goes out as it is (its own line is another one's to spoil), and echoes and events come at
// once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <random>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::test {

struct Unreliability {
  double lost = 0.0;           // share of the frames heard
  double doubled = 0.0;        // of those that are not lost
  std::int64_t latest_ns = 0;  // each is late by 0 to this, evenly spread: one may overtake another
};

class UnreliableBus : public can::Bus {
 public:
  UnreliableBus(can::Bus& bus, unsigned seed) : bus_(bus), random_(seed) {}

  void spoil(const Unreliability& how) { how_ = how; }
  void set_now(std::int64_t now_ns) { now_ns_ = now_ns; }

  can::SendResult send(const can::Frame& frame) override { return bus_.send(frame); }
  can::Reception receive() override {
    for (auto found = bus_.receive(); found.kind != can::Reception::Kind::nothing; found = bus_.receive()) {
      if (found.kind != can::Reception::Kind::frame) return found;
      if (happens(how_.lost)) continue;
      const int copies = happens(how_.doubled) ? 2 : 1;
      for (int i = 0; i < copies; ++i)
        late_.push_back({now_ns_ + std::uniform_int_distribution<std::int64_t>(0, how_.latest_ns)(random_), found});
    }
    const auto due = std::ranges::min_element(late_, {}, &Late::due_ns);
    if (due == late_.end() || due->due_ns > now_ns_) return {};
    const can::Reception found = due->found;
    late_.erase(due);
    return found;
  }
  bool purge() override { return bus_.purge(); }
  void maintain(std::int64_t now_ns) override { bus_.maintain(now_ns); }
  bool is_open() const override { return bus_.is_open(); }
  int poll_fd() const override { return bus_.poll_fd(); }
  const can::BusCounters& counters() const override { return bus_.counters(); }

 private:
  struct Late {
    std::int64_t due_ns;
    can::Reception found;
  };
  bool happens(double share) { return std::uniform_real_distribution<>(0, 1)(random_) < share; }

  can::Bus& bus_;
  std::mt19937 random_;
  Unreliability how_;
  std::int64_t now_ns_ = 0;
  std::deque<Late> late_;
};

}  // namespace bevel::test
