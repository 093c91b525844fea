#pragma once
// LCM for the nodes: every message that comes in goes through the one checked decode, every one that goes out is
// checked before. One lcm::LCM per thread; no exception leaves a handler.
#include <algorithm>
#include <bevel/actuator_state_t.hpp>
#include <bevel/motion_command_t.hpp>
#include <bevel/needle_state_t.hpp>
#include <bevel/process_status_t.hpp>
#include <bevel/steering_target_t.hpp>
#include <bevel/tip_measurement_t.hpp>
#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>
#include <vector>

#include "io/checked_decode.hpp"
#include "io/messages.hpp"

namespace bevel::nodes {

struct PortCounters {
  std::int64_t received = 0;
  std::int64_t rejected = 0;  // by the checked decode, in or out
};

class LcmPort {
 public:
  // The LCM must be good and outlive the port.
  explicit LcmPort(lcm::LCM& lcm) : lcm_(lcm) {}
  ~LcmPort();
  LcmPort(const LcmPort&) = delete;
  LcmPort& operator=(const LcmPort&) = delete;

  // `keep`: length of LCM's own queue. A full queue keeps the oldest messages, so a node reads often and keeps it
  // short.
  template <class Message>
  void subscribe(const char* channel, std::function<void(const Message&)> handler, int keep = 30) {
    subscriptions_.push_back(std::make_unique<Subscription<Message>>(counters_, std::move(handler)));
    auto* typed = static_cast<Subscription<Message>*>(subscriptions_.back().get());
    typed->lcm_subscription = lcm_.subscribe(channel, &Subscription<Message>::on_message, typed);
    typed->lcm_subscription->setQueueCapacity(keep);
  }

  // False when the message is not fit to be sent (counted) or LCM refuses it.
  template <class Message>
  bool publish(const char* channel, const Message& message) {
    if (io::check_fields(message)) {
      ++counters_.rejected;
      return false;
    }
    buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    return lcm_.publish(channel, buffer_.data(), static_cast<unsigned>(buffer_.size())) == 0;
  }

  // The configuration's text, once at start, so that a log is complete.
  void publish_text(const char* channel, const std::string& text);

  const PortCounters& counters() const { return counters_; }

 private:
  struct SubscriptionBase {
    virtual ~SubscriptionBase() = default;
    lcm::Subscription* lcm_subscription = nullptr;
  };
  template <class Message>
  struct Subscription : SubscriptionBase {
    Subscription(PortCounters& port_counters, std::function<void(const Message&)> on)
        : counters(port_counters), handler(std::move(on)) {}
    void on_message(const lcm::ReceiveBuffer* buffer, const std::string&) {
      const auto decoded = io::checked_decode<Message>(buffer->data, buffer->data_size);
      if (!decoded) {
        ++counters.rejected;
        return;
      }
      ++counters.received;
      handler(*decoded);
    }
    PortCounters& counters;
    std::function<void(const Message&)> handler;
  };

  lcm::LCM& lcm_;
  PortCounters counters_;
  std::vector<std::unique_ptr<SubscriptionBase>> subscriptions_;
  std::vector<std::uint8_t> buffer_;
};

// What a node says of itself on PROCESS_STATUS, about twice a second.
class StatusReporter {
 public:
  StatusReporter(LcmPort& port, std::string process, double period_s);
  // For a process whose steps its input drives; those of run_periodic() are measured there.
  void note_run(double run_s) { run_max_s_ = std::max(run_max_s_, run_s); }
  void note_overrun() { ++overruns_; }  // of a bound of the process's own, beside those of its loop
  // Sends when it is time or when state or reason changed.
  void report(std::int64_t now_utime, const std::string& state, const std::string& reason);

 private:
  LcmPort& port_;
  process_status_t message_{};
  std::int64_t last_utime_ = 0;
  double run_max_s_ = 0;
  std::int64_t overruns_ = 0;
};

}  // namespace bevel::nodes
