// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Checked LCM input and output of the nodes.
///
/// Each received message passes a checked decode, the watch over its sender (io/sender_watch.hpp) and, on channels that
/// carry motion, a plausibility check (bevel/io/motion_bounds.hpp). Each published message is checked before. A message
/// that does not pass is counted and not passed on. Signs of a second sender, of impossible motion or of a clock that
/// was set are troubles, for which the node must stop. Use one lcm::LCM per thread. No exception leaves a handler: it
/// is stored, and step() of the node rethrows it.
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

/// Counters of a port since construction.
struct PortCounters {
  std::int64_t received = 0;  ///< messages passed on to a handler
  std::int64_t rejected = 0;  ///< messages rejected by any of the checks, received or published
};

/// A trouble in the inputs of a node.
struct InputTrouble {
  /// Kind of trouble.
  enum class Kind {
    second_sender,  ///< a second sender, or old messages sent again
    out_of_order,   ///< delayed messages, or two senders
    implausible,    ///< impossible motion
    clock_step      ///< the wall clock was set
  };
  Kind kind = Kind::second_sender;  ///< kind of trouble
  const char* channel = "";         ///< channel, static string; "" for the clock
  io::Implausible implausible;      ///< motion found; for Kind::implausible
  double clock_step_s = 0;          ///< step of the wall clock, s; for Kind::clock_step
};
/// Describes a trouble for the operator.
/// @param trouble trouble
/// @return text without a line break
std::string describe(const InputTrouble& trouble);

/// Subscribes and publishes for one node.
class LcmPort {
 public:
  /// Creates a port without subscriptions.
  /// @param lcm LCM; must be good and outlive the port
  explicit LcmPort(lcm::LCM& lcm) : lcm_(lcm) {}
  ~LcmPort();
  LcmPort(const LcmPort&) = delete;
  LcmPort& operator=(const LcmPort&) = delete;

  /// Sets the time at which messages are handled and sent. Call it before messages are handled and before each step. A
  /// step of the wall clock is reported by on_trouble.
  /// @param now present time
  void tell_time(const Now& now);
  /// @return time set by tell_time()
  const Now& now() const { return now_; }

  /// Function that processes a message.
  template <class Message>
  using Handler = std::function<void(const Message&)>;
  /// Function that checks a message against the previous one of its sender.
  template <class Message>
  using MotionCheck = std::function<io::Implausible(const Message& before, const Message& next)>;

  /// Subscribes with a checked decode only, for messages that the node does not act on.
  /// @param channel channel
  /// @param handler called with each message
  /// @param keep    length of LCM's own queue; a full queue keeps the oldest messages
  template <class Message>
  void subscribe(const char* channel, Handler<Message> handler, int keep = kQueue) {
    add(std::make_unique<Subscription<Message>>(*this, channel, std::move(handler)), keep);
  }
  /// Subscribes with all checks, for messages that the node acts on.
  /// @param channel channel
  /// @param limits  limits of age and rate of each sender
  /// @param handler called with each message that passes
  /// @param check   plausibility check; empty: none
  template <class Message>
  void subscribe(const char* channel, const io::SenderLimits& limits, Handler<Message> handler,
                 MotionCheck<Message> check = nullptr) {
    auto subscription = std::make_unique<Subscription<Message>>(*this, channel, std::move(handler));
    subscription->limits = limits;
    subscription->check = std::move(check);
    add(std::move(subscription), kQueue);
  }

  /// Called immediately when a trouble is found, before anything else is handled.
  std::function<void(const InputTrouble&)> on_trouble;
  /// Called for messages that a watched channel rejects without a trouble, with the reason.
  std::function<void(const char* channel, io::Standing)> on_refused;

  /// Accepts new senders from now on, after the operator has checked and armed again. The operator's own commands are
  /// still compared with the previous ones.
  void forget_senders() { restart_watches(io::channel::kSteeringTarget); }

  /// Publishes a message.
  /// @param channel channel
  /// @param message message
  /// @return false if the message has invalid fields (counted as rejected) or LCM rejects it
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

  /// Publishes text without a message type, such as the configuration at the start, so that a log is complete.
  /// @param channel channel
  /// @param text    text
  void publish_text(const char* channel, const std::string& text);

  /// Passes the messages of this process through a fault injector, for tests of the stop.
  /// @param injector injector; null: none
  void inject(std::unique_ptr<FaultInjector> injector) { injector_ = std::move(injector); }

  /// Counts the message that is being handled as rejected: the node rejects it by a check that the port does not have.
  void reject() {
    --counters_.received;
    ++counters_.rejected;
  }

  /// Rethrows the exception that a handler threw, if any.
  void rethrow();
  /// @return counters since construction
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

    /// One sender on a watched channel.
    struct Sender {
      io::SenderWatch watch;          ///< watch over its stream
      std::optional<Message> before;  ///< newest fresh message
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

/// Returns the key that distinguishes the senders on a channel. Each camera numbers its own messages.
/// @return 0; the camera number in the specialisations
template <class Message>
std::int32_t sender_key(const Message&) {
  return 0;
}
/// Returns the camera number of a tip measurement.
/// @param message message
/// @return camera number
template <>
inline std::int32_t sender_key(const tip_measurement_t& message) {
  return message.camera;
}
/// Returns the camera number of a tip heading.
/// @param message message
/// @return camera number
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
