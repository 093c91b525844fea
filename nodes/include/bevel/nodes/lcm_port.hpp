// SPDX-License-Identifier: MIT
#pragma once
// LCM for the nodes. Every message that comes in passes the one checked decode, the watch over its sender (io/
// sender_watch.hpp) and, where the channel carries motion, a check that it can be true (bevel/io/motion_bounds.hpp);
// every one that goes out is checked before. What does not pass is counted and never handed on; what tells of a second
// sender, of motion that cannot be or of a clock that was set is a trouble that the node must stop for. One lcm::LCM
// per thread; no exception leaves a handler: it is kept, and step() of the node raises it.
#include <bevel/actuator_state_t.hpp>
#include <bevel/motion_command_t.hpp>
#include <bevel/needle_shaft_t.hpp>
#include <bevel/needle_state_t.hpp>
#include <bevel/operator_heartbeat_t.hpp>
#include <bevel/process_status_t.hpp>
#include <bevel/steering_target_t.hpp>
#include <bevel/tip_heading_t.hpp>
#include <bevel/tip_measurement_t.hpp>
#include <cstdint>
#include <exception>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bevel/io/checked_decode.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/motion_bounds.hpp>
#include <bevel/io/sender_watch.hpp>
#include <bevel/nodes/clock_watch.hpp>
#include <bevel/nodes/fault_injector.hpp>

namespace bevel::nodes {

struct PortCounters {
  std::int64_t received = 0;  // handed on
  std::int64_t rejected = 0;  // by any of the checks, in or out
};

struct InputTrouble {
  enum class Kind { second_sender, out_of_order, implausible, clock_step };
  Kind kind = Kind::second_sender;
  const char* channel = "";     // static text; "" for the clock
  io::Implausible implausible;  // of that kind
  double clock_step_s = 0;      // of that kind
};
std::string describe(const InputTrouble& trouble);

class LcmPort {
 public:
  // The LCM must be good and outlive the port.
  explicit LcmPort(lcm::LCM& lcm) : lcm_(lcm) {}
  ~LcmPort();
  LcmPort(const LcmPort&) = delete;
  LcmPort& operator=(const LcmPort&) = delete;

  // The time at which what follows is handled and sent. Call it before messages are handled and before each step.
  void tell_time(const Now& now);
  const Now& now() const { return now_; }

  template <class Message>
  using Handler = std::function<void(const Message&)>;
  template <class Message>
  using MotionCheck = std::function<io::Implausible(const Message& before, const Message& next)>;

  // For what people and records read: checked decode alone. `keep`: length of LCM's own queue; a full one keeps the
  // oldest, so a node reads often and keeps it short.
  template <class Message>
  void subscribe(const char* channel, Handler<Message> handler, int keep = kQueue) {
    add(std::make_unique<Subscription<Message>>(*this, channel, std::move(handler)), keep);
  }
  // For what a node acts on.
  template <class Message>
  void subscribe(const char* channel, const io::SenderLimits& limits, Handler<Message> handler,
                 MotionCheck<Message> check = nullptr) {
    auto subscription = std::make_unique<Subscription<Message>>(*this, channel, std::move(handler));
    subscription->limits = limits;
    subscription->check = std::move(check);
    add(std::move(subscription), kQueue);
  }

  // Called at once when a trouble is found, before anything else is handled.
  std::function<void(const InputTrouble&)> on_trouble;
  // Called for messages that a watched channel refuses without being a trouble, with the reason.
  std::function<void(const char* channel, io::Standing)> on_refused;

  // Senders may be others from here on: the operator has looked and armed anew. His own words are still compared.
  void forget_senders() { restart_watches(io::channel::kSteeringTarget); }

  // False when the message is not fit to be sent (counted) or LCM refuses it.
  template <class Message>
  bool publish(const char* channel, const Message& message) {
    if (io::check_fields(message)) {
      ++counters_.rejected;
      return false;
    }
    buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    return send(channel, buffer_);
  }

  // The configuration's text, once at start, so that a log is complete.
  void publish_text(const char* channel, const std::string& text);

  // For tests of the stop path: what this process sends passes through the injector.
  void inject(std::unique_ptr<FaultInjector> injector) { injector_ = std::move(injector); }

  /// Counts the message that is being handled as rejected: the node refuses it by a check that the port does not have.
  void reject() {
    --counters_.received;
    ++counters_.rejected;
  }

  // Raises what a handler threw.
  void rethrow();
  const PortCounters& counters() const { return counters_; }

 private:
  static constexpr int kQueue = 30;
  static constexpr std::size_t kMostSenders = 16;  // cameras of a rig

  struct SubscriptionBase {
    virtual ~SubscriptionBase() = default;
    virtual void attach(lcm::LCM& lcm, int keep) = 0;
    virtual void restart() = 0;
    virtual const char* name() const = 0;
    lcm::Subscription* lcm_subscription = nullptr;
  };
  template <class Message>
  struct Subscription : SubscriptionBase {
    Subscription(LcmPort& owner, const char* on_channel, Handler<Message> on)
        : port(owner), channel(on_channel), handler(std::move(on)) {}
    void attach(lcm::LCM& lcm, int keep) override {
      lcm_subscription = lcm.subscribe(channel, &Subscription::on_message, this);
      lcm_subscription->setQueueCapacity(keep);
    }
    void restart() override { senders.clear(); }
    const char* name() const override { return channel; }
    void on_message(const lcm::ReceiveBuffer* buffer, const std::string&) {
      try {
        const auto decoded = io::checked_decode<Message>(buffer->data, buffer->data_size);
        if (!decoded || (limits && !passes(*decoded, *buffer))) {
          ++port.counters_.rejected;
          return;
        }
        ++port.counters_.received;
        handler(*decoded);
      } catch (...) {
        port.thrown_ = std::current_exception();
      }
    }
    bool passes(const Message& message, const lcm::ReceiveBuffer& buffer);

    struct Sender {
      io::SenderWatch watch;
      std::optional<Message> before;
    };
    LcmPort& port;
    const char* channel;
    Handler<Message> handler;
    std::optional<io::SenderLimits> limits;  // none: not watched
    MotionCheck<Message> check;
    std::map<std::int32_t, Sender> senders;  // by camera; one on other channels
  };

  void add(std::unique_ptr<SubscriptionBase> subscription, int keep);
  void report(const InputTrouble& trouble);
  void restart_watches(std::string_view but);
  bool send(const char* channel, const std::vector<std::uint8_t>& bytes);
  void flush_injector();

  lcm::LCM& lcm_;
  Now now_;
  ClockWatch clock_;
  PortCounters counters_;
  std::vector<std::unique_ptr<SubscriptionBase>> subscriptions_;
  std::vector<std::uint8_t> buffer_;
  std::unique_ptr<FaultInjector> injector_;
  std::exception_ptr thrown_;
};

// Cameras number their messages each for itself.
template <class Message>
std::int32_t sender_key(const Message&) {
  return 0;
}
template <>
inline std::int32_t sender_key(const tip_measurement_t& message) {
  return message.camera;
}
template <>
inline std::int32_t sender_key(const tip_heading_t& message) {
  return message.camera;
}

template <class Message>
bool LcmPort::Subscription<Message>::passes(const Message& message, const lcm::ReceiveBuffer& buffer) {
  const std::int32_t key = sender_key(message);
  auto found = senders.find(key);
  if (found == senders.end()) {
    if (senders.size() >= kMostSenders) return false;
    found = senders.emplace(key, Sender{io::SenderWatch(*limits), {}}).first;
  }
  Sender& sender = found->second;
  const std::string_view bytes(static_cast<const char*>(buffer.data), buffer.data_size);
  const io::Standing standing = sender.watch.judge(message.seq, message.utime, std::hash<std::string_view>{}(bytes),
                                                   port.now_.utime, port.now_.ns);
  if (standing == io::Standing::foreign) port.report({InputTrouble::Kind::second_sender, channel, {}, 0});
  if (sender.watch.out_of_order()) port.report({InputTrouble::Kind::out_of_order, channel, {}, 0});
  if (!io::usable(standing)) {
    if (port.on_refused) port.on_refused(channel, standing);
    return false;
  }
  if (check && standing == io::Standing::fresh) {
    if (sender.before)
      if (const io::Implausible found_out = check(*sender.before, message)) {
        port.report({InputTrouble::Kind::implausible, channel, found_out, 0});
        return false;
      }
    sender.before = message;
  }
  return true;
}

}  // namespace bevel::nodes
