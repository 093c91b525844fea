// SPDX-License-Identifier: MIT
// Little-endian fields inside a frame, as CANopen packs them.
#pragma once

#include <cstdint>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::rig {

inline void store(can::Frame& frame, std::size_t at, std::uint32_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) frame.data.at(at + i) = static_cast<std::uint8_t>(value >> (8 * i));
}

inline std::uint32_t load(const can::Frame& frame, std::size_t at, unsigned bytes) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < bytes; ++i) value |= static_cast<std::uint32_t>(frame.data.at(at + i)) << (8 * i);
  return value;
}

}  // namespace bevel::rig
