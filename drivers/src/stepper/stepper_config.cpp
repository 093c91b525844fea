// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/stepper_config.hpp>

#include <cmath>
#include <sstream>
#include <utility>

namespace bevel::stepper {
namespace {

constexpr double kLargestCounts = 1e9;  // rates travel as 32-bit integers
// Of the 200 ms from any fault to rest: 120 to notice it, 20 to pass it on, 60 to stop.
constexpr std::int64_t kLongestNotice_ns = 120 * kMs;
constexpr double kLongestQuickStop_s = 0.06 + 1e-9;

// As files have them.
double in_ms(std::int64_t ns) { return static_cast<double>(ns) / kMs; }

class Checker {
 public:
  template <typename T>
  void require(bool ok, const std::string& key, T value, const char* allowed) {
    if (ok) return;
    std::ostringstream text;
    text << key << " = " << value << ": must be " << allowed;
    problems_.push_back(text.str());
  }
  std::vector<std::string> take() { return std::move(problems_); }

 private:
  std::vector<std::string> problems_;
};

void check_axis(Checker& check, const AxisConfig& axis, std::int64_t period_ns, const std::string& name) {
  const int node = axis.node_id;
  check.require(node >= 1 && node <= 127, name + ".node_id", node, "1 to 127");
  const double counts = std::abs(axis.counts_per_unit);
  check.require(std::isfinite(counts) && counts > 0.0, name + ".counts_per_unit", axis.counts_per_unit,
                "finite and not 0");
  const auto rate = [&](double value, const char* key) {
    check.require(std::isfinite(value) && value > 0.0 && value * counts < kLargestCounts, name + key, value,
                  "positive, and below 1e9 counts");
  };
  rate(axis.rate_limit_unit_s, ".rate_limit_unit_s");
  rate(axis.acceleration_unit_s2, ".acceleration_unit_s2");
  rate(axis.quick_stop_unit_s2, ".quick_stop_unit_s2");
  check.require(std::isfinite(axis.counts_per_revolution) && axis.counts_per_revolution >= 0.0,
                name + ".counts_per_revolution", axis.counts_per_revolution, "0 (not configured), or positive");
  const double window = axis.following_error_unit;
  check.require(std::isfinite(window) && window >= 0.0 && window * counts < kLargestCounts,
                name + ".following_error_unit", window, "0 (the drive's own), or positive and below 1e9 counts");
  check.require(axis.position_min_unit < axis.position_max_unit, name + ".position_min_unit", axis.position_min_unit,
                "below position_max_unit");
  for (const auto& [limit, key] : {std::pair{axis.drive_position_min_unit, ".drive_position_min_unit"},
                                   std::pair{axis.drive_position_max_unit, ".drive_position_max_unit"}})
    if (limit)
      check.require(std::abs(*limit) * counts < kLargestCounts, name + key, *limit, "finite, and below 1e9 counts");
  if (const DriveLimits limits = drive_limits_of(axis, period_ns); limits.min_unit >= limits.max_unit)
    check.require(false, name + ".drive_position_min_unit", limits.min_unit, "below drive_position_max_unit");
}

}  // namespace

DriveLimits drive_limits_of(const AxisConfig& axis, std::int64_t period_ns) {
  const double rate = axis.rate_limit_unit_s;
  const double margin = rate * 2e-9 * static_cast<double>(period_ns) + 0.5 * rate * rate / axis.quick_stop_unit_s2;
  return {axis.drive_position_min_unit.value_or(axis.position_min_unit - margin),
          axis.drive_position_max_unit.value_or(axis.position_max_unit + margin)};
}

std::vector<std::string> problems_of(const StepperConfig& config) {
  Checker check;
  check_axis(check, config.axes[kInsertion], config.period_ns, "insertion");
  check_axis(check, config.axes[kRotation], config.period_ns, "rotation");
  const int master = config.master_id;
  check.require(config.axes[0].node_id != config.axes[1].node_id, "rotation.node_id",
                static_cast<int>(config.axes[1].node_id), "different from insertion.node_id");
  check.require(master >= 1 && master <= 127 && master != config.axes[0].node_id && master != config.axes[1].node_id,
                "master_id", master, "1 to 127 and no drive's node_id");
  check.require(config.boot_timeout_ns >= 100 * kMs && config.boot_timeout_ns <= 60'000 * kMs, "boot_timeout_ms",
                in_ms(config.boot_timeout_ns), "100 to 60000");
  const auto duration = [&](std::int64_t value, const char* key, std::int64_t least_ns) {
    check.require(value >= least_ns && value <= 10'000 * kMs, key, in_ms(value),
                  "no shorter than what it supervises, at most 10 s");
  };
  duration(config.period_ns, "period_ms", kMs);
  duration(config.listen_ns, "listen_ms", config.master_heartbeat_ns);
  duration(config.master_heartbeat_ns, "master_heartbeat_ms", config.period_ns);
  duration(config.master_heartbeat_timeout_ns, "master_heartbeat_timeout_ms", 2 * config.master_heartbeat_ns);
  duration(config.drive_heartbeat_ns, "drive_heartbeat_ms", kMs);
  duration(config.drive_heartbeat_timeout_ns, "drive_heartbeat_timeout_ms", 2 * config.drive_heartbeat_ns);
  duration(config.sdo_timeout_ns, "sdo_timeout_ms", config.period_ns);
  duration(config.transition_timeout_ns, "transition_timeout_ms", 10 * config.period_ns);
  duration(config.tpdo_timeout_ns, "tpdo_timeout_ms", 3 * config.period_ns);
  duration(config.echo_timeout_ns, "echo_timeout_ms", 2 * config.period_ns);
  duration(config.overrun_stop_ns, "overrun_stop_ms", 2 * config.period_ns);
  duration(config.setpoint_zero_age_ns, "setpoint_zero_age_ms", config.period_ns);
  duration(config.setpoint_stop_age_ns, "setpoint_stop_age_ms", config.setpoint_zero_age_ns);
  duration(config.not_following_ns, "not_following_ms", config.period_ns);
  duration(config.following_error_ns, "following_error_ms", kMs);
  check.require(config.mode == VelocityMode::profile || (config.period_ns % kMs == 0 && config.period_ns <= 255 * kMs),
                "period_ms", in_ms(config.period_ns), "whole milliseconds, at most 255, with mode \"csv\" (0x60C2)");
  check.require(config.sdo_retries >= 0 && config.sdo_retries <= 10, "sdo_retries", config.sdo_retries, "0 to 10");
  check.require(config.queue_full_limit >= 1, "queue_full_limit", config.queue_full_limit, "at least 1");
  check.require(config.quick_stop_option == 2 || config.quick_stop_option == 6, "quick_stop_option",
                config.quick_stop_option, "2 or 6");
  return check.take();
}

std::vector<std::string> safety_problems_of(const StepperConfig& config) {
  Checker check;
  for (std::size_t i = 0; i < kAxes; ++i) {
    const AxisConfig& axis = config.axes.at(i);
    check.require(axis.rate_limit_unit_s <= kLongestQuickStop_s * axis.quick_stop_unit_s2,
                  std::string(i == kInsertion ? "insertion" : "rotation") + ".quick_stop_unit_s2",
                  axis.quick_stop_unit_s2,
                  "at least rate_limit_unit_s / 0.06 s: the needle must rest within 200 ms of a fault");
  }
  const auto notice = [&](std::int64_t value, const char* key) {
    check.require(value <= kLongestNotice_ns, key, in_ms(value),
                  "at most 120 ms: the needle must rest within 200 ms of a fault");
  };
  check.require(config.period_ns <= 20 * kMs, "period_ms", in_ms(config.period_ns),
                "at most 20 ms: a stop is passed on within a period");
  notice(config.master_heartbeat_timeout_ns, "master_heartbeat_timeout_ms");
  notice(config.drive_heartbeat_timeout_ns, "drive_heartbeat_timeout_ms");
  notice(config.tpdo_timeout_ns, "tpdo_timeout_ms");
  notice(config.echo_timeout_ns, "echo_timeout_ms");
  notice(config.overrun_stop_ns, "overrun_stop_ms");
  notice(config.setpoint_zero_age_ns, "setpoint_zero_age_ms");
  notice(config.setpoint_stop_age_ns, "setpoint_stop_age_ms");
  notice(config.not_following_ns, "not_following_ms");
  return check.take();
}

}  // namespace bevel::stepper
