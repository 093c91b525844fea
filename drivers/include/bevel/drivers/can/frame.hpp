// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Classical CAN data frame with an 11-bit identifier, as CANopen uses it.

#include <array>
#include <cstdint>

namespace bevel::can {

/// Classical CAN data frame.
struct Frame {
  std::uint32_t id = 0;                ///< 11-bit identifier, 0x000..0x7FF
  std::uint8_t size = 0;               ///< number of valid bytes in data, 0..8
  std::array<std::uint8_t, 8> data{};  ///< payload; bytes past size are zero
  /// Compares all members.
  /// @return true if identifier, size and all data bytes are equal
  bool operator==(const Frame&) const = default;
};

inline constexpr std::uint32_t kMaxId = 0x7FF;  ///< largest 11-bit identifier

}  // namespace bevel::can
