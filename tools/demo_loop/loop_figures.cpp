// SPDX-License-Identifier: MIT
#include "tools/demo_loop/loop_figures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include <bevel/error.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/log_reader.hpp>
#include <bevel/io/messages.hpp>
#include "tools/demo_loop/steering_session.hpp"

namespace bevel::tools {
namespace {

Eigen::Vector3d position(const needle_state_t& m) { return {m.position_mm[0], m.position_mm[1], m.position_mm[2]}; }

double standard_deviation(const needle_state_t& m, std::size_t i) {
  return std::sqrt(std::max(m.covariance[10 * i], 0.0));
}

// The last arrival or miss on PROCESS_STATUS.
std::string reported_outcome(const std::string& log_path) {
  const io::FileBytes file(log_path);
  io::LogReader reader(file.bytes());
  std::string outcome;
  while (const auto event = reader.next()) {
    if (event->channel != io::channel::kProcessStatus) continue;
    const auto m = io::checked_decode<process_status_t>(event->data.data(), event->data.size());
    if (m && m->process == "bevel-controller" && (reports_arrival(m->reason) || reports_miss(m->reason)))
      outcome = m->reason;
  }
  return outcome;
}

// Truth between its samples; nothing outside them.
std::optional<Eigen::Vector3d> truth_at(const std::vector<needle_state_t>& truths, std::int64_t utime) {
  const auto after = std::lower_bound(truths.begin(), truths.end(), utime,
                                      [](const needle_state_t& m, std::int64_t t) { return m.utime < t; });
  if (after == truths.end() || after == truths.begin()) return std::nullopt;
  const auto before = after - 1;
  const double share = static_cast<double>(utime - before->utime) / static_cast<double>(after->utime - before->utime);
  return position(*before) + share * (position(*after) - position(*before));
}

double rate_hz(std::size_t count, std::int64_t first_utime, std::int64_t last_utime) {
  return last_utime > first_utime ? static_cast<double>(count - 1) * 1e6 / static_cast<double>(last_utime - first_utime)
                                  : 0;
}

// Latencies need the times of arrival, which only the log's events carry.
void measure_latencies(const std::string& log_path, LoopFigures& f) {
  const io::FileBytes file(log_path);
  io::LogReader reader(file.bytes());
  std::vector<double> to_measurement, to_command, on_to_command, periods;
  std::int64_t newest_used = 0, answered = 0, last_command = 0;
  std::map<std::int64_t, std::int64_t> arrived;  // of measurements: when, by what they were captured at
  while (const auto event = reader.next()) {
    if (event->channel == io::channel::kTipMeasurement) {
      if (const auto m = io::checked_decode<tip_measurement_t>(event->data.data(), event->data.size())) {
        to_measurement.push_back(static_cast<double>(event->timestamp_us - m->utime) * 1e-3);
        arrived[m->utime] = event->timestamp_us;
      }
    } else if (event->channel == io::channel::kNeedleState) {
      if (const auto m = io::checked_decode<needle_state_t>(event->data.data(), event->data.size()))
        newest_used = m->measurement_utime;
    } else if (event->channel == io::channel::kMotionCommand) {
      if (last_command) periods.push_back(static_cast<double>(event->timestamp_us - last_command) * 1e-3);
      last_command = event->timestamp_us;
      if (newest_used <= answered) continue;
      answered = newest_used;
      // At rest nothing is answered: the period alone commands.
      const auto m = io::checked_decode<motion_command_t>(event->data.data(), event->data.size());
      if (!m || (m->insertion_rate_mm_s == 0 && m->rotation_rate_rad_s == 0)) continue;
      to_command.push_back(static_cast<double>(event->timestamp_us - newest_used) * 1e-3);
      if (const auto at = arrived.find(newest_used); at != arrived.end())
        on_to_command.push_back(static_cast<double>(event->timestamp_us - at->second) * 1e-3);
    }
  }
  f.camera_to_measurement_ms = percentiles(std::move(to_measurement));
  f.camera_to_command_ms = percentiles(std::move(to_command));
  f.measurement_to_command_ms = percentiles(std::move(on_to_command));
  f.command_period_ms = percentiles(std::move(periods));
}

}  // namespace

Percentiles percentiles(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(std::llround(share * static_cast<double>(values.size() - 1)))];
  };
  return {at(0.5), at(0.99), values.size()};
}

LoopFigures loop_figures(const std::string& log_path) {
  const io::Recording log = io::read_recording(log_path);
  const auto need = [&](bool there, const char* channel) {
    if (!there) throw IoError(log_path + " holds no " + channel);
  };
  need(!log.estimates.empty(), io::channel::kNeedleState);
  need(!log.truths.empty(), io::channel::kNeedleTruth);
  need(!log.commands.empty(), io::channel::kMotionCommand);
  need(!log.targets.empty(), io::channel::kSteeringTarget);
  need(!log.tips.empty() && !log.actuators.empty(), "measurements");

  LoopFigures f;
  auto since_armed = log.targets.begin();
  for (auto target = log.targets.begin(); target != log.targets.end(); ++target)
    if (target->request == 1) {
      f.target_mm = Eigen::Vector3d(target->position_mm[0], target->position_mm[1], target->position_mm[2]);
      since_armed = target;
    }
  f.truth = log.truths.back();
  // Where it came to rest, from which it may have been drawn back.
  const auto drawn_back = std::ranges::find(since_armed, log.targets.end(), 8, &steering_target_t::request);
  const auto rested = drawn_back != log.targets.end() ? truth_at(log.truths, drawn_back->utime) : std::nullopt;
  f.targeting_error_mm = (rested.value_or(position(log.truths.back())) - f.target_mm).norm();

  double sum2 = 0;
  std::size_t count = 0;
  for (const auto& estimate : log.estimates) {
    const auto truth = truth_at(log.truths, estimate.utime);
    if (!truth || estimate.measurement_utime == 0) continue;
    const double error = (position(estimate) - *truth).norm();
    sum2 += error * error;
    f.estimator_error_max_mm = std::max(f.estimator_error_max_mm, error);
    f.estimator_error_end_mm = error;
    ++count;
  }
  if (count) f.estimator_error_rms_mm = std::sqrt(sum2 / static_cast<double>(count));
  const needle_state_t& last = log.estimates.back();
  f.curvature_per_mm = last.curvature_per_mm, f.curvature_sd_per_mm = standard_deviation(last, 6);
  f.lambda1_per_rad = last.lambda1_per_rad, f.lambda1_sd_per_rad = standard_deviation(last, 7);
  f.lambda2 = last.lambda2, f.lambda2_sd = standard_deviation(last, 8);

  f.inserted_mm = log.actuators.back().insertion_mm;
  for (std::size_t i = 1; i < log.actuators.size(); ++i)
    f.turned_rev +=
        std::abs(log.actuators[i].rotation_rad - log.actuators[i - 1].rotation_rad) / (2 * std::numbers::pi);
  f.command_rate_hz = rate_hz(log.commands.size(), log.commands.front().utime, log.commands.back().utime);
  f.estimate_rate_hz = rate_hz(log.estimates.size(), log.estimates.front().utime, log.estimates.back().utime);
  f.measurement_rate_hz = rate_hz(log.tips.size(), log.tips.front().utime, log.tips.back().utime);
  f.measurements = static_cast<std::int64_t>(log.tips.size());
  f.measurements_unusable =
      std::count_if(log.tips.begin(), log.tips.end(), [](const auto& m) { return m.status != 0; });
  f.rejected_messages = log.rejected();
  f.outcome = reported_outcome(log_path);
  measure_latencies(log_path, f);
  return f;
}

std::string to_text(const LoopFigures& f) {
  char text[2048];
  std::snprintf(text, sizeof text,
                "controller reports                     %s\n"
                "targeting error (true tip to target)   %.3f mm, target (%.1f, %.1f, %.1f) mm\n"
                "estimator error (estimate to true tip) %.3f mm at the end, %.3f mm RMS, %.3f mm largest\n"
                "curvature  %.5f +- %.5f /mm   (truth %.5f)\n"
                "lambda1    %.3f +- %.3f /rad      (truth %.3f)\n"
                "lambda2    %.3f +- %.3f           (truth %.3f)\n"
                "inserted %.1f mm, turned %.1f revolutions (%.1f per 100 mm)\n"
                "rates      commands %.1f Hz, estimates %.1f Hz, measurements %.1f Hz (%lld, %lld not usable, %lld "
                "messages refused)\n"
                "latency    camera to measurement p50 %.1f ms, p99 %.1f ms (%zu)\n"
                "           camera to command     p50 %.1f ms, p99 %.1f ms (%zu, in motion)\n"
                "           measurement to command p50 %.2f ms, p99 %.2f ms (%zu)\n"
                "period     of commands           p50 %.2f ms, p99 %.2f ms (%zu)\n",
                f.outcome.empty() ? "no outcome" : f.outcome.c_str(), f.targeting_error_mm, f.target_mm.x(),
                f.target_mm.y(), f.target_mm.z(), f.estimator_error_end_mm, f.estimator_error_rms_mm,
                f.estimator_error_max_mm, f.curvature_per_mm, f.curvature_sd_per_mm, f.truth->curvature_per_mm,
                f.lambda1_per_rad, f.lambda1_sd_per_rad, f.truth->lambda1_per_rad, f.lambda2, f.lambda2_sd,
                f.truth->lambda2, f.inserted_mm, f.turned_rev, f.turned_rev / std::max(f.inserted_mm, 1.0) * 100,
                f.command_rate_hz, f.estimate_rate_hz, f.measurement_rate_hz, static_cast<long long>(f.measurements),
                static_cast<long long>(f.measurements_unusable), static_cast<long long>(f.rejected_messages),
                f.camera_to_measurement_ms.p50, f.camera_to_measurement_ms.p99, f.camera_to_measurement_ms.count,
                f.camera_to_command_ms.p50, f.camera_to_command_ms.p99, f.camera_to_command_ms.count,
                f.measurement_to_command_ms.p50, f.measurement_to_command_ms.p99, f.measurement_to_command_ms.count,
                f.command_period_ms.p50, f.command_period_ms.p99, f.command_period_ms.count);
  return text;
}

}  // namespace bevel::tools
