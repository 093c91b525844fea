#include "drivers/stepper/drive_node.hpp"

#include <algorithm>
#include <cmath>

namespace bevel::stepper {
namespace {

using cia301::NmtCommand;
using cia301::NmtState;

constexpr int kSurplusPdos = 5;  // a frame that a bus error doubled is one
constexpr std::int64_t kResetPause_ns = 500 * kMs;
constexpr std::int64_t kStartPause_ns = 100 * kMs;
constexpr std::uint8_t kStatusPdoBytes = 6;    // 6041, 606C
constexpr std::uint8_t kPositionPdoBytes = 5;  // 6064, 6061
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
  statusword_ = 0;
  error_code_ = 0;
  have_position_ = false;
  trouble_ = {};
}

void DriveNode::trouble(StopReason reason, std::uint32_t code) {
  if (trouble_.reason == StopReason::none) trouble_ = {reason, static_cast<int>(axis_), code};
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
    rate_counts_s_ = static_cast<std::int32_t>(cia301::get_u32(frame, 2));
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
    position_counts_ = raw;
    have_position_ = true;
  }
  if (!position_pdo_due_) ++surplus_pdos_;
  raw_position_ = raw;
  position_pdo_ns_ = now_ns;
  position_pdo_due_ = false;
  sampled_ns_ = sync_ns_;  // a synchronous PDO holds what was there at the SYNC
  if (phase_ == Phase::operational && frame.data[4] != static_cast<std::uint8_t>(config_.mode))
    trouble(StopReason::wrong_mode, frame.data[4]);
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
      if (now_ns >= next_nmt_ns_ && out.send(cia301::nmt(NmtCommand::reset_communication, node_), now_ns))
        next_nmt_ns_ = now_ns + kResetPause_ns;
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
      renew_limits(now_ns, out);
      break;
  }
}

void DriveNode::renew_limits(std::int64_t now_ns, Transmitter& out) {
  if (phase_ == Phase::operational && !configured()) transfer(now_ns, out);
}

void DriveNode::begin_job() {
  const SdoJob& job = script_.at(job_);
  if (job.writes()) {
    sdo_.download(job.object, job.value, job.size_bytes);
  } else {
    sdo_.upload(job.object);
  }
}

void DriveNode::next_job(std::int64_t now_ns) {
  sdo_.cancel();
  retries_ = 0;
  job_since_ns_ = now_ns;
  if (++job_ < script_.size()) return begin_job();
  if (phase_ != Phase::configuring) return;  // the limits, anew
  phase_ = Phase::starting;
  phase_since_ns_ = now_ns;
  next_nmt_ns_ = now_ns;
}

void DriveNode::finish_job(std::int64_t now_ns) {
  const SdoJob& job = script_.at(job_);
  if (job.writes() || (sdo_.value() & job.mask) == job.value) return next_job(now_ns);
  if (job.kind == SdoJob::Kind::expect_eventually && now_ns - job_since_ns_ < config_.transition_timeout_ns)
    return begin_job();
  sdo_.cancel();
  trouble(job.otherwise, code_of(job.object));
}

void DriveNode::transfer(std::int64_t now_ns, Transmitter& out) {
  using Status = cia301::SdoClient::Status;
  const SdoJob& job = script_.at(job_);
  sdo_.check_time(now_ns);
  switch (sdo_.status()) {
    case Status::idle:
      begin_job();
      break;
    case Status::done:
      finish_job(now_ns);
      break;
    case Status::aborted:
      if (sdo_.frame_to_send()) break;
      if (job.may_be_absent()) return next_job(now_ns);
      trouble(StopReason::sdo_aborted, sdo_.abort_code());
      break;
    case Status::timed_out:
      if (sdo_.frame_to_send()) break;
      if (retries_++ < config_.sdo_retries) {
        begin_job();
      } else {
        trouble(StopReason::sdo_timeout, code_of(job.object));
      }
      break;
    case Status::to_send:
    case Status::waiting:
      break;
  }
  const auto frame = sdo_.frame_to_send();
  if (frame && out.send(*frame, now_ns)) sdo_.sent(now_ns);
}

// True when sdo_ holds the answer, in one call.
bool DriveNode::ask_once(cia301::ObjectAddress object, bool& asked, std::int64_t now_ns, Transmitter& out) {
  using Status = cia301::SdoClient::Status;
  sdo_.check_time(now_ns);
  const bool answered = asked && sdo_.status() == Status::done;
  if (!asked) sdo_.upload(object);
  asked = true;
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
  const bool turned_over = config_.axes.at(axis_).counts_per_unit < 0;
  return negative != turned_over ? StopReason::lower_switch : StopReason::upper_switch;
}

bool DriveNode::command(std::uint16_t controlword, double rate_unit_s, std::int64_t now_ns, Transmitter& out) const {
  can::Frame frame{cia301::rpdo1_id(node_), 6, {}};
  cia301::put_u16(frame, 0, controlword);
  const auto rate = static_cast<std::int32_t>(std::lround(rate_unit_s * config_.axes.at(axis_).counts_per_unit));
  cia301::put_u32(frame, 2, static_cast<std::uint32_t>(rate));
  return out.send(frame, now_ns);
}

double DriveNode::position_unit() const {
  return static_cast<double>(position_counts_ - zero_counts_) / config_.axes.at(axis_).counts_per_unit;
}

double DriveNode::rate_unit_s() const {
  return static_cast<double>(rate_counts_s_) / config_.axes.at(axis_).counts_per_unit;
}

void DriveNode::set_zero() {
  zero_counts_ = position_counts_;
  position_trusted_ = true;
  if (!has_limits()) return;
  place_limits();
  const std::size_t first = script_.size() - kLimitJobs;
  if (job_ <= first) return;  // not written yet
  if (job_ < script_.size()) sdo_.cancel();
  retries_ = 0;
  job_ = first;
}

}  // namespace bevel::stepper
