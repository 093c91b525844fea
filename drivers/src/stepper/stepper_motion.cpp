// SPDX-License-Identifier: MIT
// The driver while the axes are enabled: from set-points to rates within the limits, and whether the axes follow them.
#include <algorithm>
#include <cmath>

#include <bevel/drivers/stepper/stepper_driver.hpp>

namespace bevel::stepper {
namespace {

// Noise and overshoot of a drive's reported rate: of the commanded rate, and of the axis' rate limit.
constexpr double kOvershoot = 0.2;
constexpr double kRateNoise = 0.05;

}  // namespace

bool StepperDriver::moving() const {
  return std::any_of(shapers_.begin(), shapers_.end(), [](const RateShaper& s) { return s.rate_unit_s() != 0; });
}

std::array<double, kAxes> StepperDriver::wanted_rates(std::int64_t now_ns,
                                                      const std::optional<MotionSetpoint>& setpoint) {
  std::array<double, kAxes> rates{};
  if (setpoint) {
    const bool usable = std::isfinite(setpoint->insertion_rate_mm_s) && std::isfinite(setpoint->rotation_rate_rad_s) &&
                        setpoint->age_ns >= -config_.period_ns;
    refusing_setpoints_ = !usable;
    if (!usable) {
      ++counters_.setpoints_refused;
    } else {
      fresh_setpoint_ns_ = std::max(fresh_setpoint_ns_, now_ns - std::max<std::int64_t>(setpoint->age_ns, 0));
      // By its own age: one of before a stop must not run in the time that axes just enabled give for the first.
      if (setpoint->run && setpoint->age_ns <= config_.setpoint_zero_age_ns)
        rates = {setpoint->insertion_rate_mm_s, setpoint->rotation_rate_rad_s};
      if (!setpoint->run && moving()) latch({StopReason::controller_stop}, now_ns);
    }
  }
  const std::int64_t age_ns = now_ns - fresh_setpoint_ns_;
  if (age_ns > config_.setpoint_zero_age_ns) {
    ++counters_.setpoints_stale;
    rates = {};
  }
  if (age_ns > config_.setpoint_stop_age_ns)
    latch({refusing_setpoints_ ? StopReason::setpoint_invalid : StopReason::setpoint_stale}, now_ns);
  return rates;
}

void StepperDriver::run_enabled(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint) {
  for (auto& node : nodes_) node.maintain_settings(now_ns, out_);
  supervise_motion(now_ns);
  if (state_ != DriverState::enabled) return;
  const auto rates = wanted_rates(now_ns, setpoint);
  if (state_ != DriverState::enabled) return;
  shape(now_ns, rates);
}

void StepperDriver::take(std::int64_t now_ns, const MotionSetpoint& setpoint) {
  if (state_ != DriverState::enabled || config_.mode != VelocityMode::profile) return;
  take_in(now_ns);                          // echoes, so that nothing holds the command back
  if (latched()) return send_stop(now_ns);  // or what a drive says
  if (state_ != DriverState::enabled) return;
  const auto rates = wanted_rates(now_ns, setpoint);
  if (state_ == DriverState::enabled) {
    for (std::size_t axis = 0; axis < kAxes; ++axis) follows_.at(axis).advance(now_ns, shapers_.at(axis).rate_unit_s());
    shape(now_ns, rates);
  }
  if (may_send()) send_commands(now_ns);
}

void StepperDriver::shape(std::int64_t now_ns, const std::array<double, kAxes>& rates) {
  // A late step does not buy a larger change of rate.
  const double dt_s =
      static_cast<double>(std::clamp<std::int64_t>(now_ns - shaped_ns_, 0, 2 * config_.period_ns)) * 1e-9;
  shaped_ns_ = now_ns;
  bool clamped = false;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    // Where the axis will be when this command takes effect: the position is a cycle old, the drive lags by another.
    const DriveNode& node = nodes_.at(axis);
    const double delay_s = static_cast<double>(now_ns - node.sampled_ns() + config_.period_ns) * 1e-9;
    const double ahead_unit = node.position_unit() + shapers_.at(axis).rate_unit_s() * delay_s;
    shapers_.at(axis).step(rates.at(axis), dt_s, ahead_unit);
    clamped = clamped || shapers_.at(axis).clamped();
  }
  if (clamped) ++counters_.setpoints_clamped;
}

void StepperDriver::supervise_motion(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const DriveNode& node = nodes_.at(axis);
    switch (node.state()) {
      case cia402::State::operation_enabled:
        break;
      case cia402::State::fault:
      case cia402::State::fault_reaction:
        return latch({StopReason::drive_fault, static_cast<int>(axis), node.error_code()}, now_ns);
      default:
        return latch({StopReason::drive_left_operation, static_cast<int>(axis), node.statusword()}, now_ns);
    }
    // One that was enabled there may leave it again.
    const bool came_to_limit = node.says_limit() && !at_limit_.at(axis);
    at_limit_.at(axis) = node.says_limit();
    if (came_to_limit) return latch({StopReason::travel_limit, static_cast<int>(axis)}, now_ns);
    if (!node.shows_mode()) return latch({StopReason::wrong_mode, static_cast<int>(axis)}, now_ns);
    FollowWatch& follow = follows_.at(axis);
    if (!follow.follows(now_ns, shapers_.at(axis).rate_unit_s(), node.position_unit()))
      return latch({StopReason::not_following, static_cast<int>(axis)}, now_ns);
    ScaleWatch& scale = scales_.at(axis);
    scale.add(follow.commanded_unit(), node.position_unit());
    if (const auto wrong = scale.wrong_scale())
      return latch({StopReason::wrong_scale, static_cast<int>(axis),
                    static_cast<std::uint32_t>(std::lround(1000.0 * std::max(*wrong, 0.0)))},
                   now_ns);
    const double allowed_unit_s = (1 + kOvershoot) * follow.fastest_commanded_unit_s() +
                                  kRateNoise * config_.axes.at(axis).rate_limit_unit_s +
                                  2 * node.sample().resolution_unit_s;
    if (std::abs(node.rate_unit_s()) > allowed_unit_s)
      return latch({StopReason::too_fast, static_cast<int>(axis)}, now_ns);
  }
}

}  // namespace bevel::stepper
