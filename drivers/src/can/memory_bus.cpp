// SPDX-License-Identifier: MIT
#include <bevel/drivers/can/memory_bus.hpp>

#include <algorithm>

namespace bevel::can {

std::unique_ptr<MemoryBus> MemoryNetwork::attach() {
  auto bus = std::unique_ptr<MemoryBus>(new MemoryBus(*this));
  members_.push_back(bus.get());
  return bus;
}

void MemoryNetwork::detach(const MemoryBus* bus) { std::erase(members_, bus); }

void MemoryNetwork::set_link_up(bool up) {
  if (link_up_ && !up)
    for (auto* member : members_)
      if (member->open_) member->lose(BusEvent::link_down);
  link_up_ = up;
}

void MemoryNetwork::set_acknowledged(bool on) {
  acknowledged_ = on;
  if (!on) return;
  for (auto* member : members_) {
    while (!member->transmit_.empty()) {
      const Frame frame = member->transmit_.front();
      member->transmit_.pop_front();
      deliver(member, frame);
    }
  }
}

void MemoryNetwork::raise(BusEvent event) {
  for (auto* member : members_) member->receive_.push_back({Reception::Kind::event, {}, event});
}

void MemoryNetwork::inject(const Frame& frame) { deliver(nullptr, frame); }

void MemoryNetwork::deliver(const MemoryBus* sender, Frame frame) {
  const Frame as_sent = frame;
  const bool arrives = !tap_ || tap_(frame);
  for (auto* member : members_) {
    if (!member->open_) continue;
    if (member == sender) {
      member->receive_.push_back({Reception::Kind::echo, as_sent, {}});
    } else if (arrives) {
      member->receive_.push_back({Reception::Kind::frame, frame, {}});
      ++member->counters_.received;
    }
  }
}

MemoryBus::~MemoryBus() { network_->detach(this); }

SendResult MemoryBus::send(const Frame& frame) {
  if (!open_) return SendResult::link_down;
  if (network_->acknowledged_) {
    network_->deliver(this, frame);
  } else if (transmit_.size() < kTransmitQueueFrames) {
    transmit_.push_back(frame);
  } else {
    ++counters_.queue_full;
    return SendResult::queue_full;
  }
  ++counters_.sent;
  return SendResult::sent;
}

Reception MemoryBus::receive() {
  if (receive_.empty()) return {};
  const Reception found = receive_.front();
  receive_.pop_front();
  return found;
}

void MemoryBus::lose(BusEvent why) {
  open_ = false;
  transmit_.clear();
  receive_.clear();
  receive_.push_back({Reception::Kind::event, {}, why});
}

bool MemoryBus::purge() {
  open_ = false;
  transmit_.clear();
  receive_.clear();
  return true;
}

void MemoryBus::maintain(std::int64_t now_ns) {
  if (open_ || !back_off_.due(now_ns)) return;
  if (!network_->link_up()) {
    back_off_.failed(now_ns);
    return;
  }
  back_off_.succeeded();
  open_ = true;
  ++counters_.reopens;
  receive_.push_back({Reception::Kind::event, {}, BusEvent::reopened});
}

}  // namespace bevel::can
