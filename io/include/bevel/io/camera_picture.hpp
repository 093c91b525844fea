// SPDX-License-Identifier: MIT
/// \file
/// Checked decoding of CAMERA_PICTURE, the only message that contains raw bytes. bevel/io/checked_decode.hpp decodes
/// all other messages.
#pragma once

#include <array>
#include <bevel/camera_picture_t.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <bevel/io/checked_decode.hpp>

namespace bevel::io {

namespace channel {
inline constexpr const char* kCameraPicture = "CAMERA_PICTURE";  ///< channel of camera_picture_t
}  // namespace channel

inline constexpr std::int32_t kLargestPicture_px = 640;        ///< largest width and height, px
inline constexpr std::int32_t kLargestPicture_bytes = 60'000;  ///< largest JPEG, bytes: one datagram

/// Reads width and height of a JPEG from its markers up to the start of its data.
/// @param jpeg  bytes of the image
/// @return width and height in px; nothing if the bytes are not a complete JPEG
std::optional<std::array<std::int32_t, 2>> jpeg_size_px(const std::vector<std::uint8_t>& jpeg) noexcept;

/// Decodes an image message. In addition to the checks of all messages it rejects an image that is not a JPEG of the
/// stated size, and a usable tip outside it.
/// @param data  encoded message; may be null
/// @param size  number of bytes
/// @return the message, or the reason why it was rejected
template <>
Decoded<camera_picture_t> checked_decode<camera_picture_t>(const void* data, std::size_t size) noexcept;
/// Checks an image message, as checked_decode<camera_picture_t>().
/// @param message  message to check
/// @return the first fault; nothing if the message is valid
template <>
std::optional<DecodeError> check_fields<camera_picture_t>(const camera_picture_t& message) noexcept;

}  // namespace bevel::io
