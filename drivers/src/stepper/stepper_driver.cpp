// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/stepper_driver.hpp>

#include <algorithm>
#include <string>

#include <bevel/drivers/can/drain.hpp>
#include <bevel/error.hpp>

namespace bevel::stepper {
namespace {

constexpr std::int64_t kPurgePause_ns = 500 * kMs;
constexpr std::uint64_t kFaultResetSteps =
    4;  // half a period of the fault reset bit, long enough to survive a lost PDO

StepperConfig checked(const StepperConfig& config) {
  std::string text;
  for (const auto& problem : problems_of(config)) text += (text.empty() ? "stepper: " : "; ") + problem;
  if (!text.empty()) throw ArgumentError(text);
  return config;
}

}  // namespace

StepperDriver::StepperDriver(can::Bus& bus, const StepperConfig& config)
    : config_(checked(config)),
      bus_(bus),
      out_(bus, config_),
      nodes_{DriveNode(config_, kInsertion), DriveNode(config_, kRotation)},
      shapers_{RateShaper(config_.axes[kInsertion]), RateShaper(config_.axes[kRotation])},
      follows_{FollowWatch(config_.not_following_ns, config_.period_ns),
               FollowWatch(config_.not_following_ns, config_.period_ns)} {}

std::vector<std::uint32_t> StepperDriver::listen_ids(const StepperConfig& config) {
  // What we send is heard too: as our echoes, and as a sign of another master.
  std::vector<std::uint32_t> ids{cia301::kNmtId, cia301::kSyncId, cia301::heartbeat_id(config.master_id)};
  for (const auto& axis : config.axes) {
    const auto node = axis.node_id;
    ids.insert(ids.end(),
               {cia301::emcy_id(node), cia301::tpdo1_id(node), cia301::tpdo2_id(node), cia301::rpdo1_id(node),
                cia301::sdo_response_id(node), cia301::sdo_request_id(node), cia301::heartbeat_id(node)});
  }
  return ids;
}

bool StepperDriver::all_in(cia402::State state) const {
  return std::all_of(nodes_.begin(), nodes_.end(), [&](const DriveNode& node) {
    return node.phase() == DriveNode::Phase::operational && node.state() == state;
  });
}

EnableAnswer StepperDriver::enable() {
  if (state_ != DriverState::ready) return EnableAnswer::not_ready;
  for (const auto& node : nodes_)
    if (!node.position_trusted()) return EnableAnswer::position_not_trusted;
  if (!std::ranges::all_of(nodes_, &DriveNode::configured)) return EnableAnswer::not_ready;
  if (!enable_wanted_) enable_since_ns_ = last_step_ns_;
  enable_wanted_ = true;
  return EnableAnswer::accepted;
}

void StepperDriver::stop_now(StopReason reason, std::int64_t now_ns) {
  if (latched()) return;
  take_in(now_ns);  // echoes, so that nothing holds the stop back
  latch({reason}, now_ns);
  send_stop(now_ns);
}

bool StepperDriver::rearm() {
  if (!latched()) return false;
  const bool listen_first = silent_ || stop_.reason == StopReason::foreign_master || !bus_.is_open();
  state_ = listen_first ? DriverState::off : DriverState::configuring;
  state_since_ns_ = listen_since_ns_ = last_step_ns_;
  silent_ = withhold_heartbeat_ = false;
  reset_faults_ = true;
  stop_ = later_ = {};
  orders_.fill(StopOrder::none);
  for (auto& rest : rests_) rest.end();
  for (auto& node : nodes_) node.restart();
  return true;
}

void StepperDriver::set_zero() {
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    rests_.at(axis).set_zero(nodes_.at(axis).position_unit());
    nodes_.at(axis).set_zero();
    follows_.at(axis).begin(last_step_ns_, 0);
    scales_.at(axis).begin();
  }
}

void StepperDriver::confirm_position() {
  for (auto& node : nodes_) node.confirm_position();
}

void StepperDriver::on_trouble(const Stop& trouble, std::int64_t now_ns) {
  switch (state_) {
    case DriverState::ready:
    case DriverState::enabled:
    case DriverState::stopped:
    case DriverState::fault:
      latch(trouble, now_ns);
      break;
    case DriverState::configuring:
      // Nothing has been enabled yet: what passes by itself is waited out. A drive that still complains about its lost
      // master does so once more while it is reset.
      stop_ = trouble;
      if (is_fault(trouble.reason) && trouble.reason != StopReason::drive_emergency) latch(trouble, now_ns);
      break;
    case DriverState::off:
      stop_ = trouble;
      break;
  }
}

void StepperDriver::purge(std::int64_t now_ns) {
  if (now_ns < next_purge_ns_) return;
  next_purge_ns_ = now_ns + kPurgePause_ns;
  ++counters_.purges;
  (void)bus_.purge();  // where it is not permitted, one old frame per identifier may still go out
  out_.forget();
}

void StepperDriver::on_event(can::BusEvent event, std::int64_t now_ns) {
  using can::BusEvent;
  StopReason reason = StopReason::none;
  switch (event) {
    case BusEvent::error_passive:
      reason = StopReason::bus_error_passive;
      break;
    case BusEvent::bus_off:
      reason = StopReason::bus_off;
      break;
    case BusEvent::link_down:
    case BusEvent::gone:
      reason = StopReason::link_down;
      break;
    case BusEvent::reopened:
      out_.forget();
      listen_since_ns_ = now_ns;
      return;
    case BusEvent::recovered:
    case BusEvent::overflow:
      ++counters_.bus_errors;
      return;  // lost answers show up as time-outs
  }
  ++counters_.bus_errors;
  out_.forget();
  if (reason != StopReason::link_down) purge(now_ns);
  on_trouble({reason}, now_ns);
  if (state_ == DriverState::configuring) state_ = DriverState::off;
}

void StepperDriver::on_frame(const can::Frame& frame, std::int64_t now_ns) {
  if (!out_.is_ours(frame.id)) {
    for (auto& node : nodes_) node.on_frame(frame, now_ns);
    return;
  }
  // Only a master sends this, and it was not us. While we have not sent anything ourselves, we leave the bus to it.
  if (state_ == DriverState::off) silent_ = true;
  const bool known = latched() && stop_.reason == StopReason::foreign_master;
  if (!known) latch({StopReason::foreign_master, -1, frame.id}, now_ns);
}

void StepperDriver::receive(std::int64_t now_ns) {
  const bool was_latched = latched();
  take_in(now_ns);
  if (latched() && !was_latched) return send_stop(now_ns);
  if (!may_send()) return;
  for (std::size_t axis = 0; axis < kAxes; ++axis)
    if (command_waits_.at(axis) && !out_.waits_for_echo(cia301::rpdo1_id(config_.axes.at(axis).node_id)))
      send_command(axis, now_ns);
}

void StepperDriver::take_in(std::int64_t now_ns) {
  can::drain(
      bus_, [&](const can::Frame& frame) { on_frame(frame, now_ns); },
      [&](const can::Frame& frame) { out_.on_echo(frame); }, [&](can::BusEvent event) { on_event(event, now_ns); });
  for (auto& node : nodes_)
    if (const Stop trouble = node.take_trouble(); trouble.reason != StopReason::none) on_trouble(trouble, now_ns);
}

void StepperDriver::note_timing(std::int64_t now_ns) {
  if (counters_.steps++ == 0) {
    listen_since_ns_ = state_since_ns_ = now_ns;
  } else {
    const std::int64_t elapsed_ns = now_ns - last_step_ns_;
    if (elapsed_ns > config_.period_ns * 3 / 2) ++counters_.overruns;
    if (state_ == DriverState::enabled && elapsed_ns > config_.overrun_stop_ns)
      latch({StopReason::driver_overrun}, now_ns);
  }
}

void StepperDriver::supervise_transmission(std::int64_t now_ns) {
  StopReason reason = StopReason::none;
  if (out_.refused_in_a_row() >= config_.queue_full_limit) reason = StopReason::queue_full;
  if (out_.longest_wait_ns(now_ns) > config_.echo_timeout_ns) reason = StopReason::transmit_stalled;
  if (reason == StopReason::none || now_ns < next_purge_ns_) return;
  on_trouble({reason}, now_ns);
  purge(now_ns);
  if (state_ == DriverState::configuring) state_ = DriverState::off;
}

void StepperDriver::step(std::int64_t now_ns, const std::optional<MotionSetpoint>& setpoint) {
  note_timing(now_ns);
  bus_.maintain(now_ns);
  take_in(now_ns);
  for (auto& node : nodes_) {
    node.supervise(now_ns);
    if (const Stop trouble = node.take_trouble(); trouble.reason != StopReason::none) on_trouble(trouble, now_ns);
  }
  supervise_transmission(now_ns);
  switch (state_) {
    case DriverState::off:
      run_off(now_ns);
      break;
    case DriverState::configuring:
      run_configuring(now_ns);
      break;
    case DriverState::ready:
      run_ready(now_ns);
      break;
    case DriverState::enabled:
      run_enabled(now_ns, setpoint);
      break;
    case DriverState::stopped:
    case DriverState::fault:
      supervise_stop(now_ns);
      ask_why(now_ns);
      break;
  }
  transmit(now_ns);
  last_step_ns_ = now_ns;
}

void StepperDriver::run_off(std::int64_t now_ns) {
  if (!bus_.is_open()) listen_since_ns_ = now_ns;
  if (now_ns - listen_since_ns_ < config_.listen_ns) return;
  state_ = DriverState::configuring;
  state_since_ns_ = now_ns;
  for (auto& node : nodes_) node.restart();
}

void StepperDriver::run_configuring(std::int64_t now_ns) {
  bool all_operational = true;
  for (auto& node : nodes_) {
    node.configure(now_ns, out_);
    all_operational = all_operational && node.phase() == DriveNode::Phase::operational;
  }
  if (!all_operational) {
    state_since_ns_ = now_ns;  // a drive may be switched on much later
    return;
  }
  const bool out_of_time = now_ns - state_since_ns_ > config_.transition_timeout_ns;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const DriveNode& node = nodes_.at(axis);
    const bool in_fault = node.state() == cia402::State::fault;
    // The operator asked for a reset by rearm(), and by nothing else.
    if (in_fault && (!reset_faults_ || out_of_time))
      return latch({StopReason::drive_fault, static_cast<int>(axis), node.error_code()}, now_ns);
    if (out_of_time && node.state() != cia402::State::ready_to_switch_on)
      return latch({StopReason::start_timeout, static_cast<int>(axis), node.statusword()}, now_ns);
  }
  if (!all_in(cia402::State::ready_to_switch_on)) return;
  state_ = DriverState::ready;
  stop_ = {};
  reset_faults_ = false;
}

void StepperDriver::run_ready(std::int64_t now_ns) {
  for (auto& node : nodes_) node.maintain_settings(now_ns, out_);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const auto state = nodes_.at(axis).state();
    if (state == cia402::State::fault || state == cia402::State::fault_reaction)
      return latch({StopReason::drive_fault, static_cast<int>(axis), nodes_.at(axis).error_code()}, now_ns);
  }
  if (!enable_wanted_) return supervise_disabling(now_ns);
  const bool modes_shown = std::ranges::all_of(nodes_, &DriveNode::shows_mode);
  if (all_in(cia402::State::operation_enabled) && modes_shown) {
    state_ = DriverState::enabled;
    for (auto& rest : rests_) rest.end();
    fresh_setpoint_ns_ = shaped_ns_ = now_ns;
    refusing_setpoints_ = false;
    for (std::size_t axis = 0; axis < kAxes; ++axis) {
      follows_.at(axis).begin(now_ns, nodes_.at(axis).position_unit());
      scales_.at(axis).begin();
      at_limit_.at(axis) = nodes_.at(axis).says_limit();
    }
  } else if (now_ns - enable_since_ns_ > config_.transition_timeout_ns) {
    latch({StopReason::enable_timeout}, now_ns);
  }
}

std::uint16_t StepperDriver::controlword_for(std::size_t axis) const {
  using cia402::Goal;
  const DriveNode& node = nodes_.at(axis);
  if (latched()) {
    if (orders_.at(axis) >= StopOrder::disable_voltage) return cia402::controlword::kDisableVoltage;
    // An axis that was held back would jump by what it is behind when it comes free: once it rests it is let go.
    if (held_back_.at(axis) && node.state() == cia402::State::quick_stop_active)
      return cia402::controlword::kDisableVoltage;
    return cia402::controlword_towards(Goal::stop, node.state());
  }
  if (state_ == DriverState::configuring && reset_faults_ && node.state() == cia402::State::fault)
    return counters_.steps / kFaultResetSteps % 2 == 0 ? cia402::controlword::kFaultReset
                                                       : cia402::controlword::kDisableVoltage;
  const bool on = state_ == DriverState::enabled || enable_wanted_;
  return cia402::controlword_towards(on ? Goal::enabled : Goal::ready, node.state());
}

void StepperDriver::send_command(std::size_t axis, std::int64_t now_ns) {
  DriveNode& node = nodes_.at(axis);
  command_waits_.at(axis) = false;
  // A stop is meant for every drive, also for one that we do not see.
  if (node.phase() != DriveNode::Phase::operational && !latched()) return;
  const double rate = state_ == DriverState::enabled ? shapers_.at(axis).rate_unit_s() : 0.0;
  const bool accepted = node.command(controlword_for(axis), rate, now_ns, out_);
  command_waits_.at(axis) = !accepted && out_.waits_for_echo(cia301::rpdo1_id(config_.axes.at(axis).node_id));
}

void StepperDriver::send_commands(std::int64_t now_ns) {
  for (std::size_t axis = 0; axis < kAxes; ++axis) send_command(axis, now_ns);
}

void StepperDriver::send_stop(std::int64_t now_ns) {
  if (!may_send()) return;
  send_commands(now_ns);
  // What SYNC latches must not wait for the next one.
  if (config_.mode == VelocityMode::cyclic && out_.send(cia301::sync(), now_ns))
    for (auto& node : nodes_) node.on_sync(now_ns);
}

void StepperDriver::transmit(std::int64_t now_ns) {
  if (state_ == DriverState::off || !may_send()) return;
  send_commands(now_ns);
  if (out_.send(cia301::sync(), now_ns))
    for (auto& node : nodes_) node.on_sync(now_ns);
  if (!withhold_heartbeat_ && now_ns >= next_heartbeat_ns_ &&
      out_.send(cia301::heartbeat(config_.master_id, cia301::NmtState::operational), now_ns))
    next_heartbeat_ns_ = now_ns + config_.master_heartbeat_ns;
}

}  // namespace bevel::stepper
