// SPDX-License-Identifier: MIT
#include "tests/loop/live_rig.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include <bevel/estimator/health.hpp>
#include <bevel/nodes/needle_pose.hpp>

namespace bevel::test {
namespace {

constexpr double kInTissue_mm = 2, kAhead_mm = 40;
constexpr auto kLook = std::chrono::milliseconds(2);
constexpr std::int64_t kWordPeriod_ns = 300 * kMs;
// A drive has given its driver up by then and stops by itself: what is asked now changes nothing any more.
constexpr std::int64_t kDriverGivenUp_ns = 110 * kMs;

constexpr std::int64_t kRested_ns = 50 * kMs;  // shorter is the end of a stop, in which an axis may swing

using io::ProcessState;

bool latched(const process_status_t& status) { return io::is_latched_stop(status.state_code); }

}  // namespace

LiveRig::LiveRig(const std::string& bin, const std::string& config_path, const std::string& out,
                 const std::map<std::string, std::vector<std::string>>& prefix)
    : config_(nodes::load_system_config(config_path)), lcm_(config_.lcm_url), port_(lcm_), heartbeat_(port_) {
  if (!lcm_.good()) throw std::runtime_error("LCM does not start");
  std::filesystem::create_directories(out);
  port_.subscribe<process_status_t>(
      io::channel::kProcessStatus,
      [this](const process_status_t& m) {
        said_[m.process] = m;
        ++watch_.heard[m.process];
        if (m.process == "bevel-rig")
          watch_.bench_late_ns = std::max<std::int64_t>(
              watch_.bench_late_ns, std::llround(1e9 * std::max(m.loop_late_max_s, m.loop_run_max_s)));
      },
      100);
  port_.subscribe<actuator_state_t>(io::channel::kActuatorState, [this](const actuator_state_t&) {
    heard(Source::axes, io::channel::kActuatorState);
  });
  port_.subscribe<tip_measurement_t>(io::channel::kTipMeasurement, [this](const tip_measurement_t&) {
    heard(Source::camera, io::channel::kTipMeasurement);
  });
  port_.subscribe<needle_state_t>(io::channel::kNeedleState, [this](const needle_state_t& m) {
    heard(Source::estimate, io::channel::kNeedleState);
    estimate = m;
  });
  port_.subscribe<needle_state_t>(io::channel::kNeedleTruth, [this](const needle_state_t& m) { truth = m; });
  port_.subscribe<motion_command_t>(io::channel::kMotionCommand, [this](const motion_command_t& m) {
    if (m.mode == 1) heard(Source::command, io::channel::kMotionCommand);
  });
  for (const char* program : kProcesses) {
    std::vector<std::string> command;
    if (const auto words = prefix.find(program); words != prefix.end()) {
      command = words->second;
      command.insert(command.begin(), "/usr/bin/env");
    }
    command.insert(command.end(), {bin + "/" + program, "--config", config_path});
    processes_.start(program, command, out + "/" + program + ".txt");
  }
  for (int tries = 0; !listener_; ++tries) {
    run(0.1);
    try {
      listener_ = std::make_unique<BusListener>(config_.can, config_.stepper);
    } catch (const std::exception&) {
      if (tries == 50) throw;
    }
  }
  begin_watch();
}

void LiveRig::heard(Source source, const char* channel) {
  heard_ns_.at(static_cast<std::size_t>(source)) = nodes::now().ns;
  ++watch_.heard[channel];
}

void LiveRig::begin_watch() {
  watch_ = {};
  watch_.begun_ns = nodes::now().ns;
  started_ = moving();
}

void LiveRig::look() {
  const nodes::Now now = nodes::now();
  if (looked_ns_ != 0) watch_.observer_late_ns = std::max(watch_.observer_late_ns, now.ns - looked_ns_);
  looked_ns_ = now.ns;
  port_.tell_time({now.ns, now.utime + clock_us});
  heartbeat_.beat();
  nodes::pump(lcm_);
  if (listener_) {
    listener_->listen();
    if (!listener_->at_rest()) listener_->ask_if_silent(kDriverGivenUp_ns);
    heard_ns_.at(static_cast<std::size_t>(Source::driver)) = listener_->driver_ns();
    judge(nodes::now().ns);
  }
  std::this_thread::sleep_for(kLook);
}

void LiveRig::judge(std::int64_t now_ns) {
  if (listener_->at_rest()) {
    if (watch_.rest_ns == 0) watch_.rest_ns = now_ns;
  } else {
    const bool rested = watch_.rest_ns != 0 && now_ns - watch_.rest_ns > kRested_ns;
    if (rested && watch_.declared_ns != 0 && !started_) watch_.moved_again = true;
    watch_.rest_ns = 0;
    for (std::size_t i = 0; i < kSources.size(); ++i)
      watch_.age_while_moving_ns.at(i) = std::max(watch_.age_while_moving_ns.at(i), now_ns - heard_ns_.at(i));
  }
  if (stop_declared()) {
    if (watch_.declared_ns == 0) watch_.declared_ns = now_ns;
    started_ = false;
  }
  const ProcessState controller = state_of("bevel-controller");
  const bool contradiction = (controller == ProcessState::armed || controller == ProcessState::steering ||
                              controller == ProcessState::retracting || controller == ProcessState::hold) &&
                             latched(said("bevel-stepper"));
  if (!contradiction) contradiction_ns_ = now_ns;
  watch_.armed_with_fault_ns = std::max(watch_.armed_with_fault_ns, now_ns - contradiction_ns_);
}

bool LiveRig::run(double seconds, const std::function<bool()>& until) {
  const std::int64_t end_ns = nodes::now().ns + std::llround(seconds * 1e9);
  while (nodes::now().ns < end_ns) {
    look();
    if (until()) return true;
  }
  return false;
}

void LiveRig::say(nodes::Word word) {
  if (word == nodes::Word::start) started_ = true;
  steering_target_t m{};
  m.utime = nodes::now().utime + clock_us;
  m.seq = seq_++;
  m.request = static_cast<std::int32_t>(word);
  const std::array<const char*, 3> receivers{"bevel-controller", "bevel-stepper", "bevel-estimator"};
  for (std::size_t i = 0; i < receivers.size(); ++i) m.session[i] = said(receivers.at(i)).session;
  for (int i = 0; i < 3; ++i) m.position_mm[i] = target_mm_[i];
  port_.publish(io::channel::kSteeringTarget, m);
}

void LiveRig::aim_ahead() {
  if (!estimate || estimate->position_mm[2] < kInTissue_mm) return;
  const model::Pose tip = nodes::read_pose(*estimate);
  target_mm_ = tip.p_mm + kAhead_mm * tip.R.col(2);
}

bool LiveRig::arm(double within_s) {
  std::int64_t next_ns = 0;
  return run(within_s, [&] {
    const ProcessState controller = state_of("bevel-controller"), axes = state_of("bevel-stepper");
    if (controller == ProcessState::armed && axes == ProcessState::enabled) return true;
    const std::int64_t now_ns = nodes::now().ns;
    const bool seen = estimate && estimator::lost(estimate->health) == 0;
    // Who lost sight of the axes for a while asks; counters and needle are where they were, and the operator knows.
    const auto asks_to_confirm = [this](const char* process) {
      return said(process).reason.find("or confirm") != std::string::npos;
    };
    const bool asks = asks_to_confirm("bevel-stepper") || asks_to_confirm("bevel-estimator");
    const bool stopped = latched(said("bevel-stepper"));
    const bool wants = controller != ProcessState::armed || stopped || asks;
    const bool heard_of = said_.contains("bevel-controller");
    if (now_ns >= next_ns && wants && (seen || latched(said("bevel-controller")) || stopped) && heard_of) {
      next_ns = now_ns + kWordPeriod_ns;
      if (asks) say(nodes::Word::confirm);
      say(nodes::Word::arm);
    }
    return false;
  });
}

bool LiveRig::steer(double within_s, double steered_s) {
  const std::int64_t end_ns = nodes::now().ns + std::llround(within_s * 1e9);
  const auto left_s = [end_ns] { return 1e-9 * static_cast<double>(end_ns - nodes::now().ns); };
  while (left_s() > 0) {
    aim_ahead();
    if (!arm(left_s())) return false;
    say(nodes::Word::start);
    if (!run(kWordPeriod_ns * 1e-9, [this] { return moving(); })) continue;
    run(steered_s, [this] { return stop_declared(); });
    if (moving() && !stop_declared()) return true;
  }
  return false;
}

bool LiveRig::stop_declared() const { return latched(said("bevel-controller")) || latched(said("bevel-stepper")); }

io::ProcessState LiveRig::state_of(const std::string& process) const {
  return static_cast<ProcessState>(said(process).state_code);
}

const process_status_t& LiveRig::said(const std::string& process) const {
  static const process_status_t kNothing{};
  const auto found = said_.find(process);
  return found == said_.end() ? kNothing : found->second;
}

std::string LiveRig::states() const {
  std::string text;
  for (const auto& [name, status] : said_)
    text += (text.empty() ? "" : "; ") + name + " " + status.state +
            (status.reason.empty() ? "" : " (" + status.reason + ")");
  return text;
}

std::string LiveRig::broken() {
  const auto death = processes_.first_death();
  return death ? "a process died: " + *death : "";
}

double LiveRig::ms_to_rest(std::int64_t from_ns) const {
  return watch_.rest_ns == 0 ? -1 : 1e-6 * static_cast<double>(std::max<std::int64_t>(watch_.rest_ns - from_ns, 0));
}

}  // namespace bevel::test
