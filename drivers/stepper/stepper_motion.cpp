// The driver while the axes are enabled: from set-points to rates within the limits, whether the axes follow them, and
// how they come to rest after a stop.
#include <algorithm>
#include <cmath>

#include "drivers/stepper/stepper_driver.hpp"

namespace bevel::stepper {
namespace {

constexpr double kHeldBack_unit = 0.04;  // mm or rad that an axis may jump by when it comes free
constexpr double kResting_unit_s = 0.05;
constexpr double kTold_s = 0.03;  // from a command to its effect: two cycles and the drive's own

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
      if (!setpoint->run && moving()) latch({StopReason::controller_stop, -1, 0});
    }
  }
  const std::int64_t age_ns = now_ns - fresh_setpoint_ns_;
  if (age_ns > config_.setpoint_zero_age_ns) {
    ++counters_.setpoints_stale;
    rates = {};
  }
  if (age_ns > config_.setpoint_stop_age_ns)
    latch({refusing_setpoints_ ? StopReason::setpoint_invalid : StopReason::setpoint_stale, -1, 0});
  return rates;
}

void StepperDriver::run_enabled(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint) {
  for (auto& node : nodes_) node.renew_limits(now_ns, out_);
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
        return latch({StopReason::drive_fault, static_cast<int>(axis), node.error_code()});
      default:
        return latch({StopReason::drive_left_operation, static_cast<int>(axis), node.statusword()});
    }
    // One that was enabled there may leave it again.
    const bool came_to_limit = node.says_limit() && !at_limit_.at(axis);
    at_limit_.at(axis) = node.says_limit();
    if (came_to_limit) return latch({StopReason::travel_limit, static_cast<int>(axis), 0});
    if (!follows_.at(axis).follows(now_ns, shapers_.at(axis).rate_unit_s(), node.position_unit()))
      return latch({StopReason::not_following, static_cast<int>(axis), 0});
  }
}

// What only the drive knows of a stop.
void StepperDriver::ask_why(std::int64_t now_ns) {
  if (silent_) return;
  if (stop_.reason == StopReason::travel_limit)
    stop_.reason = nodes_.at(static_cast<std::size_t>(stop_.axis)).read_limit(now_ns, out_);
  for (auto& node : nodes_) node.read_error_code(now_ns, out_);
}

// Whether each drive that was enabled says that it obeys, within the time that its answers may take.
void StepperDriver::supervise_stop(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis)
    if (nodes_.at(axis).confirms_stop(stopped_ns_)) stop_confirmed_.at(axis) = true;
  const bool confirmed = std::ranges::all_of(stop_confirmed_, [](bool each) { return each; });
  if (confirmed || withhold_heartbeat_ || now_ns - stopped_ns_ <= config_.tpdo_timeout_ns) return;
  withhold_heartbeat_ = true;
  ++counters_.heartbeats_withheld;
}

// Disabled, each drive has its ramp's time to leave "operation enabled".
void StepperDriver::supervise_disabling(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const AxisConfig& limits = config_.axes.at(axis);
    const auto ramp_ns = std::llround(1e9 * limits.rate_limit_unit_s / limits.acceleration_unit_s2);
    const bool late = now_ns - stopped_ns_ > config_.tpdo_timeout_ns + ramp_ns;
    if (late && nodes_.at(axis).state() == cia402::State::operation_enabled)
      return latch({StopReason::not_following, static_cast<int>(axis), 0});
  }
}

// Once an axis rests after a stop: is it where it should be, or was it held back?
void StepperDriver::judge_rest(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const DriveNode& node = nodes_.at(axis);
    if (judged_.at(axis) || std::abs(node.rate_unit_s()) > kResting_unit_s) continue;
    judged_.at(axis) = true;
    FollowWatch& follow = follows_.at(axis);
    follow.follows(now_ns, 0, node.position_unit());
    // What moved went on by the way of the quick stop, and by what it moved before it was told.
    const double rate = stopped_from_unit_s_.at(axis);
    const double stopping = 0.5 * rate * std::abs(rate) / config_.axes.at(axis).quick_stop_unit_s2;
    const double behind = std::abs(follow.behind_unit() + stopping);
    held_back_.at(axis) = behind > kHeldBack_unit + kTold_s * std::abs(rate);
  }
}

}  // namespace bevel::stepper
