// SPDX-License-Identifier: MIT
#include <bevel/drivers/commissioning/bus_probe.hpp>

#include <algorithm>

#include <bevel/drivers/can/drain.hpp>

namespace bevel::drivers {
namespace {

namespace cia301 = stepper::cia301;
using Status = cia301::SdoClient::Status;

constexpr std::int64_t kTimeout_ns = 250 * stepper::kMs;
constexpr cia301::ObjectAddress kHeartbeat{0x1017, 0};

}  // namespace

const std::vector<BusProbe::Job>& BusProbe::jobs() {
  // A drive may have no text and no units.
  static const std::vector<Job> all{{{0x1000, 0}},
                                    {{0x1018, 1}},
                                    {{0x1018, 2}},
                                    {{0x1018, 3}},
                                    {{0x1018, 4}},
                                    {{0x6502, 0}},
                                    {{0x60A8, 0}, Job::Kind::optional},
                                    {{0x60A9, 0}, Job::Kind::optional},
                                    {{0x60AA, 0}, Job::Kind::optional},
                                    {{0x6096, 1}, Job::Kind::optional},
                                    {{0x6092, 1}, Job::Kind::optional},
                                    {{0x6092, 2}, Job::Kind::optional},
                                    {{0x6091, 1}, Job::Kind::optional},
                                    {{0x6091, 2}, Job::Kind::optional},
                                    {{0x608F, 1}, Job::Kind::optional},
                                    {{0x608F, 2}, Job::Kind::optional},
                                    {kHeartbeat},
                                    {kHeartbeat, Job::Kind::set},
                                    {{0x1008, 0}, Job::Kind::text}};
  return all;
}

BusProbe::BusProbe(can::Bus& bus, const stepper::StepperConfig& config)
    : bus_(bus),
      config_(config),
      asked_{Asked{cia301::SdoClient(config.axes[0].node_id, kTimeout_ns)},
             Asked{cia301::SdoClient(config.axes[1].node_id, kTimeout_ns)}} {}

void BusProbe::enter(Phase phase, std::int64_t now_ns) {
  phase_ = phase;
  since_ns_ = now_ns;
}

bool BusProbe::of_a_master(std::uint32_t id) const {
  if (id == cia301::kNmtId || id == cia301::kSyncId || id == cia301::heartbeat_id(config_.master_id)) return true;
  return std::any_of(config_.axes.begin(), config_.axes.end(), [id](const stepper::AxisConfig& axis) {
    return id == cia301::rpdo1_id(axis.node_id) || id == cia301::sdo_request_id(axis.node_id);
  });
}

void BusProbe::on_event(can::BusEvent event) {
  using can::BusEvent;
  measured_.error_passive = measured_.error_passive || event == BusEvent::error_passive;
  measured_.bus_off = measured_.bus_off || event == BusEvent::bus_off;
  measured_.lost = measured_.lost || event == BusEvent::link_down || event == BusEvent::gone;
}

void BusProbe::on_frame(const can::Frame& frame, std::int64_t now_ns) {
  ++measured_.received;
  if (of_a_master(frame.id)) measured_.master_id = frame.id;
  for (std::size_t axis = 0; axis < stepper::kAxes; ++axis) {
    Asked& asked = asked_.at(axis);
    const auto node = config_.axes.at(axis).node_id;
    if (frame.id == cia301::sdo_response_id(node) && phase_ != Phase::listening) asked.sdo.on_response(frame);
    if (frame.id != cia301::heartbeat_id(node) || phase_ != Phase::watching) continue;
    DriveMeasured& drive = measured_.drives.at(axis);
    drive.longest_silence_ns = std::max(drive.longest_silence_ns, now_ns - asked.heard_ns);
    asked.heard_ns = now_ns;
    ++drive.heartbeats;
  }
}

void BusProbe::on_echo(std::int64_t now_ns) {
  ++measured_.echoed;
  if (awaiting_echo_ns_) measured_.slowest_echo_ns = std::max(measured_.slowest_echo_ns, now_ns - *awaiting_echo_ns_);
  if (measured_.echoed == measured_.sent) awaiting_echo_ns_.reset();
}

void BusProbe::receive(std::int64_t now_ns) {
  can::drain(
      bus_, [&](const can::Frame& frame) { on_frame(frame, now_ns); }, [&](const can::Frame&) { on_echo(now_ns); },
      [&](can::BusEvent event) { on_event(event); });
}

void BusProbe::exchange(Asked& asked, std::int64_t now_ns) {
  asked.sdo.check_time(now_ns);
  const auto frame = asked.sdo.frame_to_send();
  if (!frame || bus_.send(*frame) != can::SendResult::sent) return;
  asked.sdo.sent(now_ns);
  ++measured_.sent;
  if (!awaiting_echo_ns_) awaiting_echo_ns_ = now_ns;
}

void BusProbe::begin_job(std::size_t axis) {
  Asked& asked = asked_.at(axis);
  const Job& job = jobs().at(asked.job);
  const auto heartbeat_ms = static_cast<std::uint32_t>(config_.drive_heartbeat_ns / stepper::kMs);
  if (job.kind == Job::Kind::number || job.kind == Job::Kind::optional) asked.sdo.upload(job.object);
  if (job.kind == Job::Kind::text) asked.sdo.upload_text(job.object);
  if (job.kind == Job::Kind::set) asked.sdo.download(job.object, heartbeat_ms, 2);
}

void BusProbe::end_job(std::size_t axis, bool worked) {
  Asked& asked = asked_.at(axis);
  DriveMeasured& drive = measured_.drives.at(axis);
  const Job& job = jobs().at(asked.job);
  const auto [index, sub] = job.object;
  if (worked) {
    drive.answered = true;
    if (index == 0x1000) drive.device_type = asked.sdo.value();
    if (index == 0x1018) drive.identity.at(sub - 1U) = asked.sdo.value();
    if (index == 0x6502) drive.modes = asked.sdo.value();
    if (index == 0x1008) drive.name = asked.sdo.text();
    if (index == 0x1017 && job.kind == Job::Kind::number) asked.old_heartbeat_ms = asked.sdo.value();
    if (auto* stated = drive.units.find(job.object)) *stated = asked.sdo.value();
    if (job.kind == Job::Kind::set) asked.heartbeat_set = true;
  } else if (job.kind != Job::Kind::text && job.kind != Job::Kind::optional && !drive.refused_object) {
    drive.refused_object = std::uint32_t{index} << 8 | sub;
    drive.refusal = asked.sdo.abort_code();
  }
  // A drive that is not there is not asked again and again.
  asked.done = ++asked.job == jobs().size() || asked.sdo.status() == Status::timed_out;
  if (!asked.done) begin_job(axis);
}

void BusProbe::ask(std::size_t axis, std::int64_t now_ns) {
  Asked& asked = asked_.at(axis);
  if (asked.sdo.status() == Status::idle) begin_job(axis);
  exchange(asked, now_ns);
  const Status status = asked.sdo.status();
  const bool quiet = !asked.sdo.frame_to_send();
  if (status == Status::done) end_job(axis, true);
  if ((status == Status::aborted || status == Status::timed_out) && quiet) end_job(axis, false);
}

void BusProbe::restore(std::size_t axis, std::int64_t now_ns) {
  Asked& asked = asked_.at(axis);
  if (asked.done) return;
  exchange(asked, now_ns);
  const Status status = asked.sdo.status();
  asked.done = status != Status::to_send && status != Status::waiting && !asked.sdo.frame_to_send();
}

void BusProbe::step(std::int64_t now_ns) {
  if (since_ns_ < 0) since_ns_ = now_ns;
  bus_.maintain(now_ns);
  measured_.open = bus_.is_open();
  receive(now_ns);
  const auto all_done = [this] {
    return std::all_of(asked_.begin(), asked_.end(), [](const Asked& asked) { return asked.done; });
  };
  const auto watch = [&] {
    for (Asked& asked : asked_) asked.heard_ns = now_ns;
    enter(Phase::watching, now_ns);
  };
  switch (phase_) {
    case Phase::listening:
      if (now_ns - since_ns_ < kListen_ns) break;
      if (!measured_.open) {
        enter(Phase::done, now_ns);
      } else if (measured_.master_id) {
        watch();
      } else {
        enter(Phase::asking, now_ns);
      }
      break;
    case Phase::asking:
      for (std::size_t axis = 0; axis < stepper::kAxes; ++axis)
        if (!asked_.at(axis).done) ask(axis, now_ns);
      // A bus that takes nothing leaves its requests to be sent for ever.
      if (all_done() || now_ns - since_ns_ > 10 * kTimeout_ns) watch();
      break;
    case Phase::watching:
      if (now_ns - since_ns_ < kWatch_ns) break;
      for (std::size_t axis = 0; axis < stepper::kAxes; ++axis) {
        Asked& asked = asked_.at(axis);
        DriveMeasured& drive = measured_.drives.at(axis);
        drive.longest_silence_ns = std::max(drive.longest_silence_ns, now_ns - asked.heard_ns);
        asked.done = !asked.heartbeat_set;
        if (asked.heartbeat_set) asked.sdo.download(kHeartbeat, asked.old_heartbeat_ms, 2);
      }
      enter(Phase::restoring, now_ns);
      break;
    case Phase::restoring:
      for (std::size_t axis = 0; axis < stepper::kAxes; ++axis) restore(axis, now_ns);
      if (all_done() || now_ns - since_ns_ > 2 * kTimeout_ns) enter(Phase::done, now_ns);
      break;
    case Phase::done:
      break;
  }
}

}  // namespace bevel::drivers
