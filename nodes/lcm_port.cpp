#include "nodes/lcm_port.hpp"

#include "nodes/runtime.hpp"

namespace bevel::nodes {
namespace {
constexpr std::int64_t kStatusPeriod_us = 500'000;
}

LcmPort::~LcmPort() {
  for (const auto& s : subscriptions_)
    if (s->lcm_subscription) lcm_.unsubscribe(s->lcm_subscription);
}

void LcmPort::publish_text(const char* channel, const std::string& text) {
  lcm_.publish(channel, text.data(), static_cast<unsigned>(text.size()));
}

StatusReporter::StatusReporter(LcmPort& port, std::string process, double period_s) : port_(port) {
  message_.process = std::move(process);
  message_.loop_period_s = period_s;
}

void StatusReporter::report(std::int64_t now_utime, const std::string& state, const std::string& reason) {
  const bool changed = state != message_.state || reason != message_.reason;
  if (!changed && now_utime - last_utime_ < kStatusPeriod_us && now_utime >= last_utime_) return;
  message_.utime = now_utime;
  message_.state = state;
  message_.reason = reason;
  const LoopTimes loop = take_loop_times();
  message_.loop_late_max_s = loop.late_max_s;
  message_.loop_run_max_s = std::max(loop.run_max_s, run_max_s_);
  message_.overruns = loop.overruns + overruns_;
  message_.received = port_.counters().received;
  message_.rejected = port_.counters().rejected;
  port_.publish(io::channel::kProcessStatus, message_);
  ++message_.seq;
  run_max_s_ = 0;
  last_utime_ = now_utime;
}

}  // namespace bevel::nodes
