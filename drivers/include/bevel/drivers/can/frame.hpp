// SPDX-License-Identifier: MIT
// A classical CAN data frame with an 11-bit identifier: all that CANopen needs.
#pragma once

#include <array>
#include <cstdint>

namespace bevel::can {

struct Frame {
  std::uint32_t id = 0;                // 11-bit identifier, 0x000..0x7FF
  std::uint8_t size = 0;               // valid bytes in data, 0..8
  std::array<std::uint8_t, 8> data{};  // bytes past size are zero
  bool operator==(const Frame&) const = default;
};

inline constexpr std::uint32_t kMaxId = 0x7FF;

}  // namespace bevel::can
