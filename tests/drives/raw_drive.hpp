// SPDX-License-Identifier: MIT
// One simulated drive and a master of raw frames, in simulated time: for rules that the driver alone would never break.
#pragma once

#include <gmock/gmock.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <bevel/drivers/can/memory_bus.hpp>
#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>

namespace bevel::test {

using can::Frame;

class RawDrive : public testing::Test {
 protected:
  static constexpr std::int64_t kMs_ns = 1'000'000;
  static constexpr std::uint32_t kNoAnswer = 0xFFFFFFFF;
  static constexpr std::uint16_t kLimitBit = 1U << 11;

  void SetUp() override { step(); }

  void step(std::int64_t by_ns = kMs_ns) {
    now_ns += by_ns;
    drive->step(now_ns);
  }
  void run_ms(int ms) {
    for (int i = 0; i < ms; ++i) step();
  }
  void replace_drive(const rig::SimulatedDriveConfig& config) {
    drive = std::make_unique<rig::SimulatedDrive>(*bus, config);
    step();
  }

  // The drive's answer on SDO, after one step.
  std::optional<Frame> answer_to(const Frame& request) {
    while (peer->receive().kind != can::Reception::Kind::nothing) {
    }
    (void)peer->send(request);
    step();
    for (auto found = peer->receive(); found.kind != can::Reception::Kind::nothing; found = peer->receive())
      if (found.kind == can::Reception::Kind::frame && found.frame.id == 0x581) return found.frame;
    return std::nullopt;
  }
  std::uint32_t abort_of(const Frame& request) {
    const auto answer = answer_to(request);
    if (!answer) return kNoAnswer;
    return answer->data[0] == 0x80 ? stepper::cia301::get_u32(*answer, 4) : 0;
  }
  static Frame write(std::uint8_t command, std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    Frame frame{0x601, 8, {command}};
    stepper::cia301::put_u16(frame, 1, index);
    frame.data[3] = sub;
    stepper::cia301::put_u32(frame, 4, value);
    return frame;
  }
  // 0, or the abort code.
  std::uint32_t set(std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned bytes) {
    return abort_of(write(static_cast<std::uint8_t>(0x23 | (4 - bytes) << 2), index, sub, value));
  }
  std::int32_t get(std::uint16_t index, std::uint8_t sub = 0) {
    const auto answer = answer_to(write(0x40, index, sub, 0));
    EXPECT_TRUE(answer && (answer->data[0] & 0xE3) == 0x43) << std::hex << index;
    if (!answer) return 0;
    const unsigned bytes = 4U - (answer->data[0] >> 2 & 3U);
    return rig::sign_extended(stepper::cia301::get_u32(*answer, 4), bytes);
  }
  // A text in segments, as CiA 301 section 7.2.4.3.6 has them.
  std::string get_text(std::uint16_t index) {
    const auto begun = answer_to(write(0x40, index, 0, 0));
    if (!begun || begun->data[0] == 0x80) return "(refused)";
    if ((begun->data[0] & 2U) != 0)
      return {begun->data.begin() + 4, begun->data.begin() + 8 - (begun->data[0] >> 2 & 3U)};
    EXPECT_EQ(begun->data[0], 0x41);
    std::string text;
    for (std::uint8_t toggle = 0;; toggle ^= 0x10) {
      const auto segment = answer_to(write(0x60 | toggle, 0, 0, 0));
      if (!segment || (segment->data[0] & 0xF0) != toggle) return "(broken off)";
      text.append(segment->data.begin() + 1, segment->data.begin() + 8 - (segment->data[0] >> 1 & 7U));
      if ((segment->data[0] & 1U) != 0) break;
    }
    EXPECT_EQ(text.size(), stepper::cia301::get_u32(*begun, 4));
    return text;
  }
  void enable(std::uint32_t mode) {
    ASSERT_EQ(set(0x6060, 0, mode, 1), 0U);
    for (const std::uint32_t word : {0x06U, 0x07U, 0x0FU}) ASSERT_EQ(set(0x6040, 0, word, 2), 0U);
    ASSERT_EQ(drive->state(), rig::PowerStateMachine::State::operation_enabled);
  }
  std::uint16_t statusword() { return static_cast<std::uint16_t>(get(0x6041)); }

  can::MemoryNetwork wire;
  std::unique_ptr<can::MemoryBus> peer = wire.attach();
  std::unique_ptr<can::MemoryBus> bus = wire.attach();
  std::unique_ptr<rig::SimulatedDrive> drive = std::make_unique<rig::SimulatedDrive>(*bus, rig::SimulatedDriveConfig{});
  std::int64_t now_ns = kMs_ns;
};

}  // namespace bevel::test
