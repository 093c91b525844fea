// SPDX-License-Identifier: MIT
// The drive's settings: written by the configuration script, read back after writing, and read back cyclically.
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/drivers/stepper/drive_node.hpp>

namespace bevel::stepper {
namespace {

// Between two cyclic read-backs, in periods. Four frames of at most 135 bits in 30 ms load a bus of 500 kbit/s by 4 %.
constexpr std::int64_t kMonitorEvery_periods = 3;
// The fifth time-out in a row is reported: a drive that answers none has lost its SDO server. With one frame in ten
// lost a fifth of the transfers fail, and five in a row are one in 3000.
constexpr int kUnanswered = 5;

}  // namespace

void DriveNode::maintain_settings(std::int64_t now_ns, Transmitter& out) {
  if (phase_ != Phase::operational) return;
  if (configured()) {
    monitor(now_ns, out);
  } else {
    transfer(now_ns, out);
  }
}

std::uint32_t DriveNode::value_of(const SdoJob& job) const {
  if (falls_back_ && job.fallback) return *job.fallback;
  if (job.quantity == SdoJob::Quantity::raw) return job.value;
  const double scale =
      job.quantity == SdoJob::Quantity::velocity ? scales_.velocity_per_count_s : scales_.acceleration_per_count_s2;
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::uint32_t>(std::clamp(std::round(job.amount_counts * scale), 1.0, kLargest));
}

void DriveNode::begin_job() {
  const SdoJob& job = script_.at(job_);
  if (job.kind == SdoJob::Kind::write && !reads_back_) {
    settled_.at(job_).reset();
    sdo_.download(job.object, value_of(job), job.size_bytes);
  } else {
    sdo_.upload(job.object);
  }
}

void DriveNode::next_job(std::int64_t now_ns) {
  sdo_.cancel();
  retries_ = 0;
  reads_back_ = falls_back_ = false;
  job_since_ns_ = now_ns;
  if (++job_ < script_.size()) {
    if (script_.at(job_).kind != SdoJob::Kind::decide_units) return begin_job();
    return decide_units(now_ns);
  }
  monitored_ = 0;
  if (phase_ != Phase::configuring) return;  // the limits were written anew
  phase_ = Phase::starting;
  phase_since_ns_ = now_ns;
  next_nmt_ns_ = now_ns;
}

void DriveNode::decide_units(std::int64_t now_ns) {
  const UnitDecision decision = scales_of(units_, config_.axes.at(axis_));
  if (decision.refusal == StopReason::none) {
    scales_ = decision.scales;
    return next_job(now_ns);
  }
  if (trouble_.reason != StopReason::none) return;
  trouble_ = {
      .reason = decision.refusal, .axis = static_cast<int>(axis_), .code = decision.found, .object = decision.object};
}

void DriveNode::job_trouble(StopReason reason, std::uint32_t found) {
  sdo_.cancel();
  if (trouble_.reason != StopReason::none) return;
  const SdoJob& job = script_.at(job_);
  trouble_ = {.reason = reason,
              .axis = static_cast<int>(axis_),
              .code = found,
              .object = job.object,
              .wanted = value_of(job) & job.mask,
              .is_write = job.kind == SdoJob::Kind::write && !reads_back_};
}

void DriveNode::finish_job(std::int64_t now_ns) {
  const SdoJob& job = script_.at(job_);
  const std::uint32_t found = sdo_.value() & job.mask;
  switch (job.kind) {
    case SdoJob::Kind::write:
      if (!job.monitored) return next_job(now_ns);
      if (!reads_back_) {
        reads_back_ = true;
        return begin_job();
      }
      if (found != (value_of(job) & job.mask)) return job_trouble(job.otherwise, found);
      settled_.at(job_) = found;
      return next_job(now_ns);
    case SdoJob::Kind::read:
      settled_.at(job_) = found;
      if (auto* stated = units_.find(job.object)) *stated = found;
      return next_job(now_ns);
    case SdoJob::Kind::expect_eventually:
      if (found == 0) return next_job(now_ns);
      [[fallthrough]];
    case SdoJob::Kind::expect:
      if (found == job.value) return next_job(now_ns);
      if (job.kind == SdoJob::Kind::expect_eventually && now_ns - job_since_ns_ < config_.transition_timeout_ns)
        return begin_job();
      return job_trouble(job.otherwise, found);
    case SdoJob::Kind::decide_units:
      return;
  }
}

void DriveNode::on_abort(std::int64_t now_ns) {
  const SdoJob& job = script_.at(job_);
  const std::uint32_t abort_code = sdo_.abort_code();
  const bool reads = job.kind != SdoJob::Kind::write || reads_back_;
  if (!reads && job.fallback && !falls_back_ && !job.accepts_abort(abort_code)) {
    falls_back_ = true;
    return begin_job();
  }
  if (!job.accepts_abort(abort_code)) return job_trouble(StopReason::sdo_aborted, abort_code);
  // A read-only object is accepted if it already has the required value.
  if (!reads && abort_code == cia301::kAbortReadOnly && job.optional == SdoJob::Optional::may_be_fixed) {
    reads_back_ = true;
    return begin_job();
  }
  next_job(now_ns);
}

void DriveNode::transfer(std::int64_t now_ns, Transmitter& out) {
  using Status = cia301::SdoClient::Status;
  sdo_.check_time(now_ns);
  switch (sdo_.status()) {
    case Status::idle:
      if (trouble_.reason == StopReason::none) begin_job();
      break;
    case Status::done:
      finish_job(now_ns);
      break;
    case Status::aborted:
      if (!sdo_.frame_to_send()) on_abort(now_ns);
      break;
    case Status::timed_out:
      if (sdo_.frame_to_send()) break;
      if (retries_++ < config_.sdo_retries) {
        begin_job();
      } else {
        job_trouble(StopReason::sdo_timeout, 0);
      }
      break;
    case Status::to_send:
    case Status::waiting:
      break;
  }
  const auto frame = sdo_.frame_to_send();
  if (frame && out.send(*frame, now_ns)) sdo_.sent(now_ns);
}

void DriveNode::monitor(std::int64_t now_ns, Transmitter& out) {
  using Status = cia301::SdoClient::Status;
  sdo_.check_time(now_ns);
  if (monitoring_) {
    const bool ended = !sdo_.frame_to_send() && sdo_.status() != Status::waiting;
    if (ended) judge_monitored(now_ns);
  } else if (now_ns >= next_monitor_ns_ && sdo_.status() == Status::idle) {
    std::size_t looked = 0;
    while (!settled_.at(monitored_) && looked++ < script_.size()) monitored_ = (monitored_ + 1) % script_.size();
    if (!settled_.at(monitored_)) return;
    sdo_.upload(script_.at(monitored_).object);
    monitoring_ = true;
    next_monitor_ns_ = now_ns + kMonitorEvery_periods * config_.period_ns;
  }
  const auto frame = sdo_.frame_to_send();
  if (frame && out.send(*frame, now_ns)) sdo_.sent(now_ns);
}

void DriveNode::judge_monitored(std::int64_t now_ns) {
  using Status = cia301::SdoClient::Status;
  const SdoJob& job = script_.at(monitored_);
  const auto report = [&](StopReason reason, std::uint32_t found) {
    if (trouble_.reason == StopReason::none)
      trouble_ = {.reason = reason,
                  .axis = static_cast<int>(axis_),
                  .code = found,
                  .object = job.object,
                  .wanted = *settled_.at(monitored_)};
  };
  const Status status = sdo_.status();
  const std::uint32_t found = sdo_.value() & job.mask;
  monitoring_ = false;
  sdo_.cancel();
  if (status == Status::timed_out) {
    if (++unanswered_ >= kUnanswered) report(StopReason::sdo_timeout, 0);
    return;  // the same object again
  }
  unanswered_ = 0;
  if (status == Status::aborted) report(StopReason::sdo_aborted, sdo_.abort_code());
  if (status == Status::done && found != *settled_.at(monitored_)) report(StopReason::setting_changed, found);
  monitored_ = (monitored_ + 1) % script_.size();
  next_monitor_ns_ = std::max(next_monitor_ns_, now_ns);
}

}  // namespace bevel::stepper
