// SPDX-License-Identifier: MIT
// How a frame travels over the local bus: 16 bytes, id (little-endian), size, flags, two zero bytes, data.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <sys/un.h>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::can::wire {

using Packet = std::array<std::uint8_t, 16>;
inline constexpr std::size_t kFlagsAt = 5;
inline constexpr std::uint8_t kEcho = 1;  // set by the hub on what goes back to the sender

Packet encode(const Frame& frame);
std::optional<Frame> decode(std::span<const std::uint8_t> packet);  // nothing where it is not a frame
sockaddr_un address_of(const std::string& path);                    // throws DeviceError

}  // namespace bevel::can::wire
