// SPDX-License-Identifier: MIT
// How the driver stops the axes, and how it measures that they have come to rest.
#include <algorithm>
#include <cmath>

#include <bevel/drivers/stepper/stepper_driver.hpp>

namespace bevel::stepper {
namespace {

constexpr double kHeldBack_unit = 0.04;  // mm or rad that an axis may jump by when it comes free
constexpr double kResting_unit_s = 0.05;
// A command takes effect after two cycles, because one frame may be lost, and the reaction time of the drive.
constexpr std::int64_t kDriveReaction_ns = 10 * kMs;
// Until a drive that has braked reports it: two cycles, and the time in which the lag of its shaft dies out.
constexpr std::int64_t kSettling_ns = 20 * kMs;
// Without voltage, tissue and thread friction stop an axis; a motor that still turns by then is driven.
constexpr double kCoasting_s = 0.03;
constexpr std::int64_t kNmtStopPause_ns = 100 * kMs;

std::int64_t reaction_ns(const StepperConfig& config) { return 2 * config.period_ns + kDriveReaction_ns; }

// True for a trouble that is reported in addition to the stop that came before it.
bool is_reported_later(StopReason reason) {
  switch (reason) {
    case StopReason::drive_heartbeat_lost:
    case StopReason::drive_reset:
    case StopReason::pdo_lost:
    case StopReason::bus_off:
    case StopReason::link_down:
      return true;
    default:
      return is_fault(reason);
  }
}

}  // namespace

void StepperDriver::disable() {
  enable_wanted_ = false;
  if (state_ == DriverState::enabled) {
    state_ = DriverState::ready;
    for (std::size_t axis = 0; axis < kAxes; ++axis)
      watch_rest(axis, last_step_ns_, config_.axes.at(axis).acceleration_unit_s2);
  }
  if (!latched()) stopped_ns_ = last_step_ns_;
  for (auto& shaper : shapers_) shaper.reset();
}

void StepperDriver::latch(const Stop& stop, std::int64_t now_ns) {
  enable_wanted_ = false;
  if (latched()) {
    ++counters_.later_stops;
    note_later(stop);
  } else {
    judged_.fill(state_ != DriverState::enabled);
    held_back_.fill(false);
    stopped_ns_ = last_step_ns_;
    for (std::size_t axis = 0; axis < kAxes; ++axis) {
      const DriveNode& node = nodes_.at(axis);
      stopped_from_unit_s_.at(axis) = node.rate_unit_s();
      stop_confirmed_.at(axis) = node.state() != cia402::State::operation_enabled;
      const bool may_move = state_ == DriverState::enabled || rests_.at(axis).verdict() != RestWatch::Verdict::inactive;
      if (may_move) watch_rest(axis, now_ns, config_.axes.at(axis).quick_stop_unit_s2);
    }
    orders_.fill(StopOrder::quick_stop);
    stop_ = stop;
    later_ = {};
    state_ = DriverState::stopped;
  }
  for (auto& shaper : shapers_) shaper.reset();
  // A drive's heartbeat fault is expected once ours is withheld.
  if (is_fault(stop.reason) && !withhold_heartbeat_) state_ = DriverState::fault;
}

// A loss that follows another stop is reported in addition to it: "stopped by the operator" alone would hide it.
void StepperDriver::note_later(const Stop& stop) {
  const bool same = stop.reason == stop_.reason && stop.axis == stop_.axis;
  const bool caused_by_us = withhold_heartbeat_ || std::ranges::count(orders_, StopOrder::nmt_stop) > 0;
  const bool noted = later_.reason != StopReason::none && later_.reason != StopReason::pdo_lost;
  if (!same && !caused_by_us && !noted && is_reported_later(stop.reason)) later_ = stop;
}

// The fastest that the axis may be going: as its positions show, or as it was commanded and they do not show yet. The
// rate that the drive reports may have another unit, or be of another time.
void StepperDriver::watch_rest(std::size_t axis, std::int64_t now_ns, double ramp_unit_s2) {
  const AxisSample sample = nodes_.at(axis).sample();
  const auto cycles = static_cast<std::size_t>(reaction_ns(config_) / config_.period_ns);
  const double commanded =
      std::max(std::abs(shapers_.at(axis).rate_unit_s()), follows_.at(axis).fastest_commanded_unit_s(cycles));
  begin_watch(axis, now_ns, std::max(std::abs(sample.travel_rate_unit_s), commanded), ramp_unit_s2);
}

void StepperDriver::begin_watch(std::size_t axis, std::int64_t now_ns, double fastest_unit_s, double ramp_unit_s2) {
  rests_.at(axis).begin(now_ns, nodes_.at(axis).sample(), fastest_unit_s, ramp_unit_s2, reaction_ns(config_),
                        2 * config_.period_ns + kSettling_ns);
}

// False for an axis that may be moved by hand.
bool StepperDriver::holds(std::size_t axis) const {
  if (held_back_.at(axis)) return false;
  switch (nodes_.at(axis).state()) {
    case cia402::State::operation_enabled:
    case cia402::State::quick_stop_active:
    case cia402::State::fault_reaction:
      return true;
    default:
      return false;
  }
}

void StepperDriver::measure_rest(std::size_t axis, std::int64_t now_ns) {
  if (nodes_.at(axis).phase() != DriveNode::Phase::operational) return;
  if (rests_.at(axis).check(now_ns, nodes_.at(axis).sample(), holds(axis)) == RestWatch::Verdict::does_not_stop)
    escalate(axis, now_ns);
}

void StepperDriver::escalate(std::size_t axis, std::int64_t now_ns) {
  state_ = DriverState::fault;
  switch (orders_.at(axis)) {
    case StopOrder::none:
    case StopOrder::quick_stop: {
      ++counters_.stops_escalated;
      orders_.at(axis) = StopOrder::disable_voltage;
      const double rate = std::max(std::abs(nodes_.at(axis).sample().travel_rate_unit_s), kResting_unit_s);
      begin_watch(axis, now_ns, rate, rate / kCoasting_s);
      break;
    }
    case StopOrder::disable_voltage:
      // NMT stop ends the PDOs, so that motion can no longer be measured.
      orders_.at(axis) = StopOrder::nmt_stop;
      next_nmt_stop_ns_.at(axis) = now_ns;
      if (!withhold_heartbeat_) ++counters_.heartbeats_withheld;
      withhold_heartbeat_ = true;
      break;
    case StopOrder::nmt_stop:
      break;
  }
}

AxisRest StepperDriver::rest_of(std::size_t axis) const {
  if (!latched()) return AxisRest::not_stopped;
  const RestWatch& rest = rests_.at(axis);
  if (rest.verdict() == RestWatch::Verdict::at_rest) return AxisRest::at_rest;
  if (orders_.at(axis) >= StopOrder::disable_voltage) return AxisRest::does_not_stop;
  const bool measured = nodes_.at(axis).phase() == DriveNode::Phase::operational && !rest.is_overdue(last_step_ns_);
  if (rest.verdict() == RestWatch::Verdict::inactive) return AxisRest::at_rest;  // it had not been enabled
  return measured ? AxisRest::slowing : AxisRest::not_measured;
}

// Whether each axis slows as its ramp demands, and each drive that was enabled confirms the stop, within the time that
// its answers may take.
void StepperDriver::supervise_stop(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (nodes_.at(axis).confirms_stop(stopped_ns_)) stop_confirmed_.at(axis) = true;
    measure_rest(axis, now_ns);
    judge_rest(axis, now_ns);
    if (orders_.at(axis) == StopOrder::disable_voltage && may_send()) nodes_.at(axis).disable_voltage(now_ns, out_);
    const bool nmt_stop = orders_.at(axis) == StopOrder::nmt_stop && now_ns >= next_nmt_stop_ns_.at(axis) && may_send();
    if (nmt_stop && out_.send(cia301::nmt(cia301::NmtCommand::stop, config_.axes.at(axis).node_id), now_ns))
      next_nmt_stop_ns_.at(axis) = now_ns + kNmtStopPause_ns;
  }
  const bool confirmed = std::ranges::all_of(stop_confirmed_, [](bool each) { return each; });
  if (confirmed || withhold_heartbeat_ || now_ns - stopped_ns_ <= config_.tpdo_timeout_ns) return;
  withhold_heartbeat_ = true;
  ++counters_.heartbeats_withheld;
}

// A disabled axis ramps down by its acceleration and leaves "operation enabled".
void StepperDriver::supervise_disabling(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const DriveNode& node = nodes_.at(axis);
    const AxisConfig& limits = config_.axes.at(axis);
    const auto ramp_ns = std::llround(1e9 * limits.rate_limit_unit_s / limits.acceleration_unit_s2);
    const bool late = now_ns - stopped_ns_ > config_.tpdo_timeout_ns + ramp_ns;
    if (late && node.state() == cia402::State::operation_enabled)
      return latch({StopReason::not_following, static_cast<int>(axis)}, now_ns);
    if (rests_.at(axis).check(now_ns, node.sample(), holds(axis)) == RestWatch::Verdict::does_not_stop)
      return latch({StopReason::does_not_stop, static_cast<int>(axis)}, now_ns);
  }
}

// Reads from the drive which limit was reached and which error occurred.
void StepperDriver::ask_why(std::int64_t now_ns) {
  if (silent_) return;
  if (stop_.reason == StopReason::travel_limit)
    stop_.reason = nodes_.at(static_cast<std::size_t>(stop_.axis)).read_limit(now_ns, out_);
  for (auto& node : nodes_) node.read_error_code(now_ns, out_);
}

// Once an axis rests after a stop: is it where it should be, or was it held back?
void StepperDriver::judge_rest(std::size_t axis, std::int64_t now_ns) {
  const DriveNode& node = nodes_.at(axis);
  if (judged_.at(axis) || rests_.at(axis).verdict() != RestWatch::Verdict::at_rest) return;
  judged_.at(axis) = true;
  FollowWatch& follow = follows_.at(axis);
  follow.follows(now_ns, 0, node.position_unit());
  // A moving axis travels on before the command takes effect, and along the quick-stop ramp.
  const double rate = stopped_from_unit_s_.at(axis);
  const double stopping = 0.5 * rate * std::abs(rate) / config_.axes.at(axis).quick_stop_unit_s2;
  const double behind = std::abs(follow.behind_unit() + stopping);
  held_back_.at(axis) = behind > kHeldBack_unit + 1e-9 * static_cast<double>(reaction_ns(config_)) * std::abs(rate);
}

}  // namespace bevel::stepper
