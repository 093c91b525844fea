// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Encoding of a frame on the local bus: 16 bytes, id (little-endian), size, flags, two zero bytes, data.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <sys/un.h>

#include <bevel/drivers/can/frame.hpp>

namespace bevel::can::wire {

/// One frame on the local bus.
using Packet = std::array<std::uint8_t, 16>;
inline constexpr std::size_t kFlagsAt = 5;  ///< index of the byte with the flags
inline constexpr std::uint8_t kEcho = 1;    ///< flag that the hub sets on a frame that returns to its sender

/// Encodes a frame, with flags zero.
/// @param frame frame to encode
/// @return encoded frame
Packet encode(const Frame& frame);
/// Decodes a frame.
/// @param packet received bytes
/// @return the frame; empty if the size is not 16, the identifier exceeds kMaxId, or the frame has more than 8 bytes
std::optional<Frame> decode(std::span<const std::uint8_t> packet);
/// Returns the socket address of a path.
/// @param path path of the socket, 1 to 107 characters
/// @return address of family AF_UNIX
/// @throws DeviceError if the path is empty or too long
sockaddr_un address_of(const std::string& path);

}  // namespace bevel::can::wire
