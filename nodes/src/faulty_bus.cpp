// SPDX-License-Identifier: MIT
#include <bevel/nodes/faulty_bus.hpp>

#include <utility>

namespace bevel::nodes {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kRemembered_ns = 1'000 * kMs;
constexpr std::int64_t kForeignPeriod_ns = 10 * kMs;
constexpr std::uint32_t kPositionPdo = 0x280, kCommandPdo = 0x200;

}  // namespace

void FaultyBus::begin(FaultKind kind, std::int64_t start_ns, std::uint64_t seed) {
  kind_ = kind;
  start_ns_ = start_ns;
  rng_.seed(seed);
  shift_ns_ = static_cast<std::int64_t>(150 + rng_() % 350) * kMs;
  block_until_ns_ = start_ns + static_cast<std::int64_t>(150 + rng_() % 250) * kMs;
}

bool FaultyBus::deaf() const {
  return acting() && (kind_ == FaultKind::off || (kind_ == FaultKind::intermittent && now_ns_ >= pass_until_ns_));
}

void FaultyBus::maintain(std::int64_t now_ns) {
  now_ns_ = now_ns;
  inner_.maintain(now_ns);
  for (; !due_.empty() && due_.front().at_ns <= now_ns; due_.pop_front()) (void)inner_.send(due_.front().frame);
  if (!acting()) return;
  if (kind_ == FaultKind::intermittent && now_ns >= block_until_ns_) {
    pass_until_ns_ = now_ns + static_cast<std::int64_t>(30 + rng_() % 120) * kMs;
    block_until_ns_ = pass_until_ns_ + static_cast<std::int64_t>(150 + rng_() % 250) * kMs;
  }
  if (kind_ == FaultKind::second_sender && now_ns >= next_command_ns_) {
    // Another master enables the drive and has it run; the drive hears it as well as everybody else.
    next_command_ns_ = now_ns + kForeignPeriod_ns;
    const can::Frame frame{kCommandPdo + node_id_, 6, {0x0F, 0x00, 0x10, 0x27, 0x00, 0x00}};
    for_drive_.push_back(frame);
    (void)inner_.send(frame);
  }
}

can::SendResult FaultyBus::send(const can::Frame& frame) {
  using can::SendResult;
  if (!acting()) {
    past_.push_back({now_ns_, frame});
    while (past_.front().at_ns < now_ns_ - kRemembered_ns) past_.pop_front();
    return inner_.send(frame);
  }
  can::Frame out = frame;
  switch (kind_) {
    case FaultKind::off:
      return SendResult::sent;
    case FaultKind::stuck:
    case FaultKind::second_sender:
      break;
    case FaultKind::garbage:
      for (std::uint8_t i = 0; i < out.size; ++i) out.data[i] = static_cast<std::uint8_t>(rng_());
      break;
    case FaultKind::wrong:
      if (frame.id == kPositionPdo + node_id_)
        out.data[2] = static_cast<std::uint8_t>(out.data[2] + 1);  // 65536 counts
      break;
    case FaultKind::slow:
      if (now_ns_ < block_until_ns_) return SendResult::sent;
      block_until_ns_ = now_ns_ + 250 * kMs;
      break;
    case FaultKind::delayed:
      due_.push_back({now_ns_ + shift_ns_, frame});
      return SendResult::sent;
    case FaultKind::intermittent:
      if (now_ns_ >= pass_until_ns_) return SendResult::sent;
      break;
    case FaultKind::replayed:
      if (!past_.empty()) {
        (void)inner_.send(past_.front().frame);
        past_.pop_front();
      }
      break;
  }
  return inner_.send(out);
}

can::Reception FaultyBus::receive() {
  if (!for_drive_.empty()) {
    can::Reception own{can::Reception::Kind::frame, for_drive_.front(), {}};
    for_drive_.pop_front();
    return own;
  }
  can::Reception found = inner_.receive();
  while (deaf() && found.kind == can::Reception::Kind::frame) found = inner_.receive();
  return found;
}

}  // namespace bevel::nodes
