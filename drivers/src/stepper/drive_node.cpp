// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/drive_node.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bevel::stepper {
namespace {

using cia301::NmtCommand;
using cia301::NmtState;

constexpr int kSurplusPdos = 8;                    // with one frame in a hundred doubled, five occur within minutes
constexpr std::int64_t kStillRuns_ns = 300 * kMs;  // a drive whose heartbeat goes on so long has not taken a reset
constexpr std::int64_t kStartPause_ns = 100 * kMs;
constexpr std::uint8_t kStatusPdoBytes = 6;    // 6041, 606C
constexpr std::uint8_t kPositionPdoBytes = 5;  // 6064, 6061
constexpr cia301::ObjectAddress kControlword{0x6040, 0};
constexpr cia301::ObjectAddress kErrorCode{0x603F, 0};
constexpr cia301::ObjectAddress kInputs{0x60FD, 0};
constexpr std::uint32_t kNegativeSwitch = 1U << 0, kPositiveSwitch = 1U << 1;  // of kInputs, in the drive's direction

}  // namespace

DriveNode::DriveNode(const StepperConfig& config, std::size_t axis)
    : config_(config),
      axis_(axis),
      node_(config.axes.at(axis).node_id),
      limits_(drive_limits_of(config.axes.at(axis), config.period_ns)),
      script_(configuration_script(config, axis)),
      sdo_(node_, config.sdo_timeout_ns) {
  if (has_limits()) script_.resize(script_.size() + kLimitJobs);
  settled_.resize(script_.size());
  place_limits();
}

void DriveNode::place_limits() {
  if (!has_limits()) return;
  std::ranges::copy(limit_jobs(config_.axes.at(axis_), limits_, zero_counts_),
                    script_.end() - static_cast<std::ptrdiff_t>(kLimitJobs));
}

void DriveNode::restart() {
  phase_ = Phase::absent;
  next_nmt_ns_ = INT64_MIN;
  sdo_.cancel();
  monitoring_ = voltage_ordered_ = false;
  statusword_ = 0;
  error_code_ = 0;
  have_position_ = false;
  trouble_ = {};
}

void DriveNode::trouble(StopReason reason, std::uint32_t code) {
  if (trouble_.reason == StopReason::none) trouble_ = {.reason = reason, .axis = static_cast<int>(axis_), .code = code};
}

Stop DriveNode::take_trouble() {
  const Stop taken = trouble_;
  trouble_ = {};
  return taken;
}

void DriveNode::out_of_sight() {
  // Nobody watched: it may have been reset, or moved by hand.
  if (seen_operational_) position_trusted_ = false;
  phase_ = Phase::absent;
  next_nmt_ns_ = INT64_MIN;
  sdo_.cancel();
  monitoring_ = false;
}

void DriveNode::on_frame(const can::Frame& frame, std::int64_t now_ns) {
  if (frame.id == cia301::heartbeat_id(node_)) return on_heartbeat(frame, now_ns);
  if (frame.id == cia301::emcy_id(node_)) return on_emergency(frame);
  if (frame.id == cia301::sdo_response_id(node_)) return sdo_.on_response(frame);
  const bool runs = phase_ == Phase::starting || phase_ == Phase::operational;
  if (frame.id == cia301::tpdo1_id(node_) && runs) {
    if (frame.size != kStatusPdoBytes) {
      ++counters_.malformed;
      return;
    }
    if (!status_pdo_due_) ++surplus_pdos_;
    statusword_ = cia301::get_u16(frame, 0);
    raw_rate_ = static_cast<std::int32_t>(cia301::get_u32(frame, 2));
    status_pdo_ns_ = now_ns;
    status_pdo_due_ = false;
  } else if (frame.id == cia301::tpdo2_id(node_) && runs) {
    on_position(frame, now_ns);
  }
}

void DriveNode::on_position(const can::Frame& frame, std::int64_t now_ns) {
  if (frame.size != kPositionPdoBytes) {
    ++counters_.malformed;
    return;
  }
  const auto raw = static_cast<std::int32_t>(cia301::get_u32(frame, 0));
  if (have_position_) {
    // The difference modulo 2^32, so that a counter that wraps does not make the position jump.
    position_counts_ +=
        static_cast<std::int32_t>(static_cast<std::uint32_t>(raw) - static_cast<std::uint32_t>(raw_position_));
  } else {
    position_counts_ = sampled_counts_ = raw;
    have_position_ = true;
  }
  if (!position_pdo_due_) ++surplus_pdos_;
  raw_position_ = raw;
  position_pdo_ns_ = now_ns;
  position_pdo_due_ = false;
  if (sync_ns_ > sampled_ns_) {
    const double elapsed_s = static_cast<double>(sync_ns_ - sampled_ns_) * 1e-9;
    travel_rate_unit_s_ =
        static_cast<double>(position_counts_ - sampled_counts_) / (elapsed_s * config_.axes.at(axis_).counts_per_unit);
    sampled_counts_ = position_counts_;
  }
  sampled_ns_ = sync_ns_;  // a synchronous PDO holds what was there at the SYNC
  shown_mode_ = frame.data[4];
  // A drive may show no mode while it is not enabled; StepperDriver demands that it is shown while it is.
  if (phase_ == Phase::operational && !shows_mode() && shown_mode_ != 0) trouble(StopReason::wrong_mode, shown_mode_);
}

void DriveNode::on_heartbeat(const can::Frame& frame, std::int64_t now_ns) {
  const auto state = cia301::decode_heartbeat(frame);
  if (!state) {
    ++counters_.malformed;
    return;
  }
  heartbeat_ns_ = now_ns;
  nmt_state_ = *state;
  if (*state != NmtState::boot_up) {
    if (phase_ == Phase::operational && *state != NmtState::operational) trouble(StopReason::drive_left_operation);
    return;
  }
  if (phase_ != Phase::absent) {  // nobody asked for it
    out_of_sight();
    trouble(StopReason::drive_reset);
    return;
  }
  if (next_nmt_ns_ == INT64_MIN) {  // came back by itself
    out_of_sight();
    return;
  }
  phase_ = Phase::configuring;
  sdo_.cancel();
  job_ = 0;
  reads_back_ = falls_back_ = false;
  units_ = {};
  scales_ = {};
  unanswered_ = 0;
  std::ranges::fill(settled_, std::nullopt);
  retries_ = 0;
  job_since_ns_ = now_ns;
}

void DriveNode::on_emergency(const can::Frame& frame) {
  const auto emergency = cia301::decode_emergency(frame);
  if (!emergency) {
    ++counters_.malformed;
    return;
  }
  if (emergency->code == 0) return;
  error_code_ = emergency->code;
  trouble(StopReason::drive_emergency, emergency->code);
}

void DriveNode::on_sync(std::int64_t now_ns) {
  if (phase_ != Phase::operational && phase_ != Phase::starting) return;
  if (status_pdo_due_ || position_pdo_due_) ++counters_.missed_pdos;
  // Answers less questions. One that was missed may come yet, for as long as the time-out lets it, and several at once
  // where the drive or this process stood still; what goes on coming beyond that is not this drive's.
  const int missed = (status_pdo_due_ ? 1 : 0) + (position_pdo_due_ ? 1 : 0);
  const auto under_way = static_cast<int>(2 * (config_.tpdo_timeout_ns / config_.period_ns + 1));
  surplus_balance_ = std::max(surplus_balance_ + surplus_pdos_ - missed, -under_way);
  if (surplus_pdos_ == 0 && surplus_balance_ > 0) --surplus_balance_;
  surplus_pdos_ = 0;
  if (phase_ == Phase::operational && surplus_balance_ >= kSurplusPdos) trouble(StopReason::second_drive);
  status_pdo_due_ = position_pdo_due_ = true;
  sync_ns_ = now_ns;
}

void DriveNode::supervise(std::int64_t now_ns) {
  if (phase_ != Phase::operational) return;
  if (now_ns - heartbeat_ns_ > config_.drive_heartbeat_timeout_ns) {
    out_of_sight();
    trouble(StopReason::drive_heartbeat_lost);
  } else if (now_ns - std::min(status_pdo_ns_, position_pdo_ns_) > config_.tpdo_timeout_ns) {
    trouble(StopReason::pdo_lost);
  }
}

void DriveNode::configure(std::int64_t now_ns, Transmitter& out) {
  switch (phase_) {
    case Phase::absent:
      // A second reset during a boot would begin it anew; a drive that goes on running has not taken the first.
      if (waits_for_boot() && heartbeat_ns_ > reset_sent_ns_ + kStillRuns_ns) next_nmt_ns_ = now_ns;
      if (now_ns >= next_nmt_ns_ && out.send(cia301::nmt(NmtCommand::reset_communication, node_), now_ns)) {
        reset_sent_ns_ = now_ns;
        next_nmt_ns_ = now_ns + config_.boot_timeout_ns;
      }
      break;
    case Phase::configuring:
      transfer(now_ns, out);
      break;
    case Phase::starting:
      if (nmt_state_ == NmtState::operational && status_pdo_ns_ > phase_since_ns_ &&
          position_pdo_ns_ > phase_since_ns_) {
        phase_ = Phase::operational;
        seen_operational_ = true;
        error_code_asked_ = inputs_asked_ = false;
      } else if (now_ns - phase_since_ns_ > config_.transition_timeout_ns) {
        out_of_sight();
        trouble(StopReason::start_timeout);
      } else if (nmt_state_ != NmtState::operational && now_ns >= next_nmt_ns_ &&
                 out.send(cia301::nmt(NmtCommand::start, node_), now_ns)) {
        next_nmt_ns_ = now_ns + kStartPause_ns;
      }
      break;
    case Phase::operational:
      maintain_settings(now_ns, out);
      break;
  }
}

// True when sdo_ holds the answer, in one call.
bool DriveNode::ask_once(cia301::ObjectAddress object, bool& asked, std::int64_t now_ns, Transmitter& out) {
  using Status = cia301::SdoClient::Status;
  sdo_.check_time(now_ns);
  const bool busy = sdo_.status() == Status::to_send || sdo_.status() == Status::waiting;  // with another question
  if (!asked && !busy) {
    sdo_.upload(object);
    asked = true;
  }
  const bool answered = asked && sdo_.object() == object && sdo_.status() == Status::done;
  if (answered) sdo_.cancel();
  const auto frame = sdo_.frame_to_send();
  if (frame && out.send(*frame, now_ns)) sdo_.sent(now_ns);
  return answered;
}

void DriveNode::read_error_code(std::int64_t now_ns, Transmitter& out) {
  if (phase_ != Phase::operational || state() != cia402::State::fault) return;
  if (ask_once(kErrorCode, error_code_asked_, now_ns, out)) error_code_ = static_cast<std::uint16_t>(sdo_.value());
}

StopReason DriveNode::read_limit(std::int64_t now_ns, Transmitter& out) {
  if (phase_ != Phase::operational || !ask_once(kInputs, inputs_asked_, now_ns, out)) return StopReason::travel_limit;
  const bool negative = (sdo_.value() & kNegativeSwitch) != 0, positive = (sdo_.value() & kPositiveSwitch) != 0;
  if (negative == positive) return negative ? StopReason::travel_limit : StopReason::drive_limit;
  const bool inverted = config_.axes.at(axis_).counts_per_unit < 0;
  return negative != inverted ? StopReason::lower_switch : StopReason::upper_switch;
}

void DriveNode::disable_voltage(std::int64_t now_ns, Transmitter& out) {
  using Status = cia301::SdoClient::Status;
  if (phase_ != Phase::operational || voltage_ordered_) return;
  sdo_.check_time(now_ns);
  const bool is_ours = sdo_.object() == kControlword;
  const Status status = sdo_.status();
  if (is_ours && (status == Status::done || status == Status::aborted)) {
    voltage_ordered_ = true;
    return sdo_.cancel();
  }
  if (!is_ours || status == Status::idle || (status == Status::timed_out && !sdo_.frame_to_send())) {
    sdo_.cancel();
    monitoring_ = false;
    sdo_.download(kControlword, cia402::controlword::kDisableVoltage, 2);
  }
  const auto frame = sdo_.frame_to_send();
  if (frame && out.send(*frame, now_ns)) sdo_.sent(now_ns);
}

bool DriveNode::command(std::uint16_t controlword, double rate_unit_s, std::int64_t now_ns, Transmitter& out) {
  can::Frame frame{cia301::rpdo1_id(node_), 6, {}};
  cia301::put_u16(frame, 0, controlword);
  // The rounding error is added to the next command, so that the mean rate is right if the drive's unit is coarse.
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  const double wanted = rate_unit_s * velocity_units() + (rate_unit_s == 0.0 ? 0.0 : rate_residue_);
  const double rate = std::clamp(std::round(wanted), -kLargest, kLargest);
  cia301::put_u32(frame, 2, static_cast<std::uint32_t>(static_cast<std::int32_t>(rate)));
  if (!out.send(frame, now_ns)) return false;
  rate_residue_ = wanted - rate;
  return true;
}

AxisSample DriveNode::sample() const {
  return {sampled_ns_,
          status_pdo_ns_,
          position_unit(),
          rate_unit_s(),
          travel_rate_unit_s_,
          1.0 / std::abs(config_.axes.at(axis_).counts_per_unit),
          1.0 / std::abs(velocity_units())};
}

double DriveNode::velocity_units() const {
  return config_.axes.at(axis_).counts_per_unit * scales_.velocity_per_count_s;
}

double DriveNode::position_unit() const {
  return static_cast<double>(position_counts_ - zero_counts_) / config_.axes.at(axis_).counts_per_unit;
}

double DriveNode::rate_unit_s() const { return static_cast<double>(raw_rate_) / velocity_units(); }

void DriveNode::set_zero() {
  zero_counts_ = position_counts_;
  position_trusted_ = true;
  if (!has_limits()) return;
  place_limits();
  const std::size_t first = script_.size() - kLimitJobs;
  if (job_ <= first) return;  // not written yet
  sdo_.cancel();
  reads_back_ = falls_back_ = monitoring_ = false;
  retries_ = 0;
  job_ = first;
}

}  // namespace bevel::stepper
