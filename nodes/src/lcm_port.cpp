// SPDX-License-Identifier: MIT
#include <bevel/nodes/lcm_port.hpp>

#include <cstdio>
#include <utility>

namespace bevel::nodes {

std::string describe(const InputTrouble& trouble) {
  char text[160] = "";
  switch (trouble.kind) {
    case InputTrouble::Kind::second_sender:
      std::snprintf(text, sizeof text, "a second sender on %s, or old messages sent again", trouble.channel);
      break;
    case InputTrouble::Kind::out_of_order:
      std::snprintf(text, sizeof text, "%s comes out of order: delayed, or from two senders", trouble.channel);
      break;
    case InputTrouble::Kind::implausible:
      std::snprintf(text, sizeof text, "%s: %s of %.4g %s, possible is %.3g", trouble.channel, trouble.implausible.what,
                    trouble.implausible.value, trouble.implausible.unit, trouble.implausible.allowed);
      break;
    case InputTrouble::Kind::clock_step:
      std::snprintf(text, sizeof text, "the wall clock was set by %+.3f s", trouble.clock_step_s);
      break;
  }
  return text;
}

LcmPort::~LcmPort() {
  for (const auto& s : subscriptions_)
    if (s->lcm_subscription) lcm_.unsubscribe(s->lcm_subscription);
}

void LcmPort::add(std::unique_ptr<SubscriptionBase> subscription, int keep) {
  subscription->attach(lcm_, keep);
  subscriptions_.push_back(std::move(subscription));
}

void LcmPort::tell_time(const Now& now) {
  now_ = now;
  if (const std::int64_t step_us = clock_.step_us(now)) {
    // Stamps of before and after do not compare; who sends is found out anew.
    restart_watches("");
    report({InputTrouble::Kind::clock_step, "", {}, static_cast<double>(step_us) * 1e-6});
  }
  if (injector_) flush_injector();
}

void LcmPort::restart_watches(std::string_view but) {
  for (const auto& s : subscriptions_)
    if (s->name() != but) s->restart();
}

void LcmPort::report(const InputTrouble& trouble) {
  if (on_trouble) on_trouble(trouble);
}

void LcmPort::rethrow() {
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
}

void LcmPort::flush_injector() {
  injector_->flush(now_.ns, [this](const char* channel, std::span<const std::uint8_t> bytes) {
    lcm_.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size()));
  });
}

bool LcmPort::send(const char* channel, const std::vector<std::uint8_t>& bytes) {
  if (injector_ && injector_->concerns(channel)) {
    injector_->pass(channel, bytes, now_.ns, now_.utime);
    flush_injector();
    return true;
  }
  return lcm_.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size())) == 0;
}

void LcmPort::publish_text(const char* channel, const std::string& text) {
  lcm_.publish(channel, text.data(), static_cast<unsigned>(text.size()));
}

}  // namespace bevel::nodes
