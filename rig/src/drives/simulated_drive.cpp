// SPDX-License-Identifier: MIT
#include <bevel/rig/drives/simulated_drive.hpp>

#include <algorithm>

#include "drives/little_endian.hpp"

namespace bevel::rig {
namespace {

constexpr std::uint32_t kPdoInvalid = 0x80000000;
constexpr std::uint32_t kIdMask = 0x7FF;
constexpr std::uint8_t kLastSynchronous = 240;
constexpr std::uint16_t kHeartbeatError = 0x8130;
constexpr std::uint16_t kPdoTooShort = 0x8210;
constexpr int kFramesPerStep = 256;

std::uint16_t nth(std::uint16_t first, std::size_t n) { return static_cast<std::uint16_t>(first + n); }

}  // namespace

SimulatedDrive::SimulatedDrive(can::Bus& bus, const SimulatedDriveConfig& config)
    : bus_(bus),
      config_(config),
      od_(factory_settings()),
      motion_(config.following_time_s),
      units_(UnitFactors::of(od_, config_.dialect.velocity_unit)) {}

ObjectDictionary SimulatedDrive::factory_settings() const {
  ObjectDictionary od = factory_dictionary(config_.node_id, config_.identity);
  const DriveDialect& dialect = config_.dialect;
  if (dialect.velocity_unit != 0) {
    for (const std::uint8_t sub : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{2}}) od.remove({0x6096, sub});
    if (dialect.states_unit) od.add(0x60A9, 0, {4, dialect.velocity_unit, Access::read_only});
  }
  for (const auto& key : dialect.lacks) od.remove(key);
  return od;
}

void SimulatedDrive::corrupt(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
  od_.set(index, sub, value);
  written(index);
}

void SimulatedDrive::send(const can::Frame& frame) {
  if (!silent_ && !boots_at_ns_) (void)bus_.send(frame);
}

void SimulatedDrive::send_emergency(std::uint16_t code) {
  if (nmt_ == NmtState::stopped) return;
  can::Frame frame{0x080U + config_.node_id, 8, {}};
  store(frame, 0, code, 2);
  frame.data[2] = static_cast<std::uint8_t>(od_.get(0x1001));
  send(frame);
}

void SimulatedDrive::begin_boot() {
  boots_at_ns_ = now_ns_ + static_cast<std::int64_t>(config_.dialect.boot_s * 1e9);
  if (config_.dialect.boot_s == 0.0) boot();
}

void SimulatedDrive::boot() {
  boots_at_ns_.reset();
  nmt_ = NmtState::pre_operational;
  master_heard_ns_.reset();
  master_lost_ = false;
  syncs_ = {};
  held_rpdos_ = {};
  uploading_ = false;
  next_heartbeat_ns_ = now_ns_;
  send({0x700U + config_.node_id, 1, {0}});
}

void SimulatedDrive::reset_communication() {
  // Objects 0x1000 to 0x1FFF fall back to their power-on values, the profile's objects stay.
  od_.restore(factory_settings(), 0x1000, 0x1FFF);
  begin_boot();
}

void SimulatedDrive::power_cycle() {
  od_ = factory_settings();
  power_ = PowerStateMachine{};
  units_ = UnitFactors::of(od_, config_.dialect.velocity_unit);
  homing_.forget();
  motion_.let_go();
  zero_increments_ = motion_.position();  // the counter begins anew, the shaft stays where it is
  old_controlword_ = 0;
  following_error_s_ = 0.0;
  begin_boot();
}

void SimulatedDrive::raise_fault(std::uint16_t error_code) {
  od_.set(0x603F, 0, error_code);
  od_.set(0x1001, 0, 1);
  power_.on_fault();
  send_emergency(error_code);
}

void SimulatedDrive::step(std::int64_t now_ns) {
  const std::int64_t elapsed_ns = started_ ? now_ns - now_ns_ : 0;
  now_ns_ = now_ns;
  bus_.maintain(now_ns);
  if (!started_) {
    started_ = true;
    begin_boot();
  }
  if (boots_at_ns_ && now_ns >= *boots_at_ns_) boot();
  advance(static_cast<double>(elapsed_ns) * 1e-9);
  update_status();
  for (int i = 0; i < kFramesPerStep; ++i) {
    const can::Reception found = bus_.receive();
    if (found.kind == can::Reception::Kind::nothing) break;
    if (found.kind == can::Reception::Kind::frame && !silent_) on_frame(found.frame, now_ns);
  }
  const auto watched_ms = static_cast<std::int64_t>(od_.get(0x1016, 1) & 0xFFFF);
  if (master_heard_ns_ && watched_ms > 0 && now_ns - *master_heard_ns_ > watched_ms * 1'000'000) on_master_lost();
  const auto produced_ms = static_cast<std::int64_t>(od_.get(0x1017));
  if (produced_ms > 0 && now_ns >= next_heartbeat_ns_) {
    send({0x700U + config_.node_id, 1, {static_cast<std::uint8_t>(nmt_)}});
    next_heartbeat_ns_ = std::max(next_heartbeat_ns_ + produced_ms * 1'000'000, now_ns);
  }
}

void SimulatedDrive::on_frame(const can::Frame& frame, std::int64_t now_ns) {
  const std::uint32_t master = (od_.get(0x1016, 1) >> 16) & 0x7F;
  if (frame.id == 0x000) return on_nmt(frame);
  if (boots_at_ns_) return;
  if (frame.id == 0x080) return on_sync();
  if (frame.id == 0x600U + config_.node_id) return on_sdo(frame);
  if (master != 0 && frame.id == 0x700U + master) return on_master_heartbeat(now_ns);
  for (std::size_t pdo = 0; pdo < kPdos; ++pdo) {
    const std::uint32_t cob_id = od_.get(nth(0x1400, pdo), 1);
    if ((cob_id & kPdoInvalid) == 0 && frame.id == (cob_id & kIdMask)) return on_rpdo(pdo, frame);
  }
}

void SimulatedDrive::on_nmt(const can::Frame& frame) {
  if (frame.size != 2 || (frame.data[1] != 0 && frame.data[1] != config_.node_id)) return;
  switch (frame.data[0]) {
    case 0x01:
      nmt_ = NmtState::operational;
      break;
    case 0x02:
      nmt_ = NmtState::stopped;
      power_.quick_stop(od_.get_signed(0x605A));
      break;
    case 0x80:
      nmt_ = NmtState::pre_operational;
      break;
    case 0x81:
      power_cycle();
      break;
    case 0x82:
      reset_communication();
      break;
    default:
      break;
  }
}

void SimulatedDrive::on_master_heartbeat(std::int64_t now_ns) {
  master_heard_ns_ = now_ns;
  if (!master_lost_) return;
  master_lost_ = false;
  od_.set(0x1001, 0, od_.get(0x1001) & ~0x10U);
  send_emergency(0);
}

void SimulatedDrive::on_master_lost() {
  master_heard_ns_.reset();
  master_lost_ = true;
  od_.set(0x1001, 0, od_.get(0x1001) | 0x10U);
  send_emergency(kHeartbeatError);
  switch (od_.get(0x1029, 1)) {
    case 0:
      if (nmt_ == NmtState::operational) nmt_ = NmtState::pre_operational;
      break;
    case 2:
      nmt_ = NmtState::stopped;
      break;
    default:
      break;
  }
  switch (od_.get_signed(0x6007)) {
    case 1:
      raise_fault(kHeartbeatError);
      break;
    case 2:
      power_.disable_voltage();
      break;
    case 3:
      power_.quick_stop(od_.get_signed(0x605A));
      break;
    default:
      break;
  }
}

void SimulatedDrive::on_sync() {
  if (nmt_ != NmtState::operational || pdos_frozen_) return;
  for (std::size_t pdo = 0; pdo < kPdos; ++pdo) {
    if (held_rpdos_.at(pdo)) obey(pdo, *held_rpdos_.at(pdo));
    held_rpdos_.at(pdo).reset();
  }
  update_status();
  for (std::size_t pdo = 0; pdo < kPdos; ++pdo) {
    const std::uint32_t type = od_.get(nth(0x1800, pdo), 2);
    if ((od_.get(nth(0x1800, pdo), 1) & kPdoInvalid) != 0 || type == 0 || type > kLastSynchronous) continue;
    if (++syncs_.at(pdo) < type) continue;
    syncs_.at(pdo) = 0;
    send_tpdo(pdo);
  }
}

void SimulatedDrive::send_tpdo(std::size_t pdo) {
  can::Frame frame{od_.get(nth(0x1800, pdo), 1) & kIdMask, 0, {}};
  const auto count = static_cast<std::uint8_t>(od_.get(nth(0x1A00, pdo)));
  for (std::uint8_t n = 1; n <= count; ++n) {
    const std::uint32_t entry = od_.get(nth(0x1A00, pdo), n);
    const auto bytes = static_cast<std::uint8_t>((entry & 0xFF) / 8);
    store(frame, frame.size, od_.get(static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8)),
          bytes);
    frame.size = static_cast<std::uint8_t>(frame.size + bytes);
  }
  send(frame);
}

void SimulatedDrive::on_rpdo(std::size_t pdo, const can::Frame& frame) {
  if (nmt_ != NmtState::operational || pdos_frozen_) return;
  if (od_.get(nth(0x1400, pdo), 2) <= kLastSynchronous) {
    held_rpdos_.at(pdo) = frame;
  } else {
    obey(pdo, frame);
  }
}

void SimulatedDrive::obey(std::size_t pdo, const can::Frame& frame) {
  const std::uint16_t mapping = nth(0x1600, pdo);
  const auto count = static_cast<std::uint8_t>(od_.get(mapping));
  unsigned length = 0;
  for (std::uint8_t n = 1; n <= count; ++n) length += (od_.get(mapping, n) & 0xFF) / 8;
  if (frame.size < length) return send_emergency(kPdoTooShort);
  unsigned at = 0;
  for (std::uint8_t n = 1; n <= count; ++n) {
    const std::uint32_t entry = od_.get(mapping, n);
    const unsigned bytes = (entry & 0xFF) / 8;
    (void)write(static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8), load(frame, at, bytes),
                bytes);
    at += bytes;
  }
}

}  // namespace bevel::rig
