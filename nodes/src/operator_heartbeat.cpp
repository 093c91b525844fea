// SPDX-License-Identifier: MIT
#include <bevel/nodes/operator_heartbeat.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include <bevel/model/age.hpp>
#include <bevel/nodes/lcm_port.hpp>

namespace bevel::nodes {
namespace {

constexpr std::int64_t kPeriod_ns = 50'000'000;  // 20 Hz: twice the rate that is required of an operator program
constexpr double kFastest_hz = 1000;             // a main loop is not faster
constexpr std::int64_t kRemarkShown_ns = 5'000'000'000;
constexpr const char* kRemedy =
    "start the operator program, or send operator_heartbeat_t at 10 Hz from its main loop (docs/running.md)";

}  // namespace

OperatorHeartbeat::OperatorHeartbeat(LcmPort& port) : port_(port) {
  std::random_device source;
  message_.session = 1 + static_cast<std::int64_t>((std::uint64_t{source()} << 32U | source()) >> 2U);
}

bool OperatorHeartbeat::beat() {
  const Now& now = port_.now();
  if (now.ns < next_ns_) return false;
  next_ns_ = now.ns + kPeriod_ns;
  message_.utime = now.utime;
  port_.publish(io::channel::kOperatorHeartbeat, message_);
  ++message_.seq;
  return true;
}

OperatorWatch::OperatorWatch(double timeout_s)
    : timeout_ns_(std::llround(timeout_s * 1e9)),
      stream_({.longest_age_us = timeout_ns_ / 1000, .fastest_hz = kFastest_hz, .silence_us = timeout_ns_ / 1000}) {}

bool OperatorWatch::hear(const operator_heartbeat_t& m, const Now& now, bool moving) {
  if (session_ != 0 && m.session != session_) {
    if (moving || is_fresh(now)) {
      ++second_count_;
      second_ns_ = now.ns;
      return false;
    }
    stream_.restart();
  }
  const std::int64_t age_us = model::age_us(now.utime, m.utime);
  const io::Standing standing = stream_.judge(m.seq, m.utime, static_cast<std::uint64_t>(m.utime), now.utime, now.ns);
  if (standing != io::Standing::fresh) {
    refused_as_ = standing;
    refused_age_s_ = 1e-6 * static_cast<double>(age_us);
    return false;
  }
  refused_as_ = io::Standing::fresh;
  session_ = m.session;
  made_ns_ = now.ns - 1000 * std::max<std::int64_t>(age_us, 0);
  return true;
}

bool OperatorWatch::is_fresh(const Now& now) const { return session_ != 0 && now.ns - made_ns_ <= timeout_ns_; }

std::string OperatorWatch::problem(const Now& now) const {
  if (is_fresh(now)) return "";
  char text[320];
  if (refused_as_ == io::Standing::old || refused_as_ == io::Standing::ahead) {
    std::snprintf(text, sizeof text,
                  "heartbeats on OPERATOR_HEARTBEAT are refused, the newest was %.3g s %s; allowed: up to %.3g s old "
                  "(controller.operator_timeout_s); synchronise the clocks",
                  std::abs(refused_age_s_), refused_age_s_ < 0 ? "in the future" : "old",
                  1e-9 * static_cast<double>(timeout_ns_));
  } else if (session_ == 0) {
    std::snprintf(text, sizeof text, "no heartbeat on OPERATOR_HEARTBEAT; %s", kRemedy);
  } else {
    std::snprintf(text, sizeof text,
                  "newest heartbeat on OPERATOR_HEARTBEAT is %.3g s old, allowed: up to %.3g s "
                  "(controller.operator_timeout_s); %s",
                  1e-9 * static_cast<double>(now.ns - made_ns_), 1e-9 * static_cast<double>(timeout_ns_), kRemedy);
  }
  return text;
}

std::string OperatorWatch::second_operator(const Now& now) const {
  if (second_count_ == 0 || now.ns - second_ns_ > kRemarkShown_ns) return "";
  return "a second operator program is refused (" + std::to_string(second_count_) +
         " heartbeats); end it, or end the first one and arm again";
}

void OperatorWatch::restart() {
  stream_.restart();
  session_ = 0;
  refused_as_ = io::Standing::fresh;
}

}  // namespace bevel::nodes
