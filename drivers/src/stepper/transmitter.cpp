// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/transmitter.hpp>

#include <algorithm>

#include <bevel/drivers/stepper/cia301.hpp>

namespace bevel::stepper {

Transmitter::Transmitter(can::Bus& bus, const StepperConfig& config) : bus_(bus) {
  slots_[0].id = cia301::kNmtId;
  slots_[1].id = cia301::kSyncId;
  slots_[2].id = cia301::heartbeat_id(config.master_id);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    slots_.at(3 + 2 * axis).id = cia301::rpdo1_id(config.axes.at(axis).node_id);
    slots_.at(4 + 2 * axis).id = cia301::sdo_request_id(config.axes.at(axis).node_id);
  }
}

bool Transmitter::send(const can::Frame& frame, std::int64_t now_ns) {
  const auto slot = std::find_if(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.id == frame.id; });
  if (slot == slots_.end()) return false;
  if (slot->outstanding) {
    ++held_back_;
    return false;
  }
  switch (bus_.send(frame)) {
    case can::SendResult::sent:
      slot->outstanding = true;
      slot->sent_ns = now_ns;
      refused_in_a_row_ = 0;
      return true;
    case can::SendResult::queue_full:
      ++refused_in_a_row_;
      return false;
    case can::SendResult::link_down:
    case can::SendResult::gone:
      break;  // reported as an event as well
  }
  return false;
}

void Transmitter::on_echo(const can::Frame& frame) {
  for (auto& slot : slots_)
    if (slot.id == frame.id) slot.outstanding = false;
}

bool Transmitter::waits_for_echo(std::uint32_t id) const {
  return std::any_of(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.id == id && s.outstanding; });
}

void Transmitter::forget() {
  for (auto& slot : slots_) slot.outstanding = false;
  refused_in_a_row_ = 0;
}

bool Transmitter::is_ours(std::uint32_t id) const {
  return std::any_of(slots_.begin(), slots_.end(), [&](const Slot& s) { return s.id == id; });
}

std::int64_t Transmitter::longest_wait_ns(std::int64_t now_ns) const {
  std::int64_t longest_ns = 0;
  for (const auto& slot : slots_)
    if (slot.outstanding) longest_ns = std::max(longest_ns, now_ns - slot.sent_ns);
  return longest_ns;
}

}  // namespace bevel::stepper
