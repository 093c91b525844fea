// SPDX-License-Identifier: MIT
#include <bevel/nodes/status_reporter.hpp>

#include <random>

#include <bevel/nodes/runtime.hpp>

namespace bevel::nodes {
namespace {

constexpr std::int64_t kStatusPeriod_ns = 500'000'000;
constexpr std::int64_t kOtherGone_ns = 3 * kStatusPeriod_ns;  // two lost messages in a row are no end of a process
constexpr int kStopBits = 20;                                 // of a session: a million stops of one run

std::int64_t draw_run() {
  std::random_device source;
  return static_cast<std::int64_t>((std::uint64_t{source()} << 32U | source()) >> (kStopBits + 1));
}

}  // namespace

StatusReporter::StatusReporter(LcmPort& port, std::string process, double period_s) : port_(port), run_(draw_run()) {
  message_.process = std::move(process);
  message_.loop_period_s = period_s;
  message_.session = run_ << kStopBits;
  // The port may outlive this: the handler owns what it writes.
  port_.subscribe<process_status_t>(io::channel::kProcessStatus,
                                    [&port, name = message_.process, run = run_, other_ns = other_ns_](const auto& m) {
                                      if (m.process == name && m.session >> kStopBits != run) *other_ns = port.now().ns;
                                    });
}

bool StatusReporter::name_taken() const { return *other_ns_ && port_.now().ns - **other_ns_ <= kOtherGone_ns; }

void StatusReporter::report(io::ProcessState state, const std::string& reason) {
  const Now& now = port_.now();
  const auto code = static_cast<std::int32_t>(state);
  const bool changed = message_.seq == 0 || code != message_.state_code || reason != message_.reason ||
                       message_.session != last_session_;
  if (!changed && now.ns - last_ns_ < kStatusPeriod_ns) return;
  message_.utime = now.utime;
  message_.state = io::to_string(state);
  message_.state_code = code;
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
  last_ns_ = now.ns;
  last_session_ = message_.session;
}

}  // namespace bevel::nodes
