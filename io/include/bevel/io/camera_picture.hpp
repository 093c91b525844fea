// SPDX-License-Identifier: MIT
// Checked decoding of CAMERA_PICTURE, the only message that contains raw bytes. All others:
// bevel/io/checked_decode.hpp.
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
inline constexpr const char* kCameraPicture = "CAMERA_PICTURE";
}  // namespace channel

inline constexpr std::int32_t kLargestPicture_px = 640;        // either side
inline constexpr std::int32_t kLargestPicture_bytes = 60'000;  // one datagram

// Width and height that a JPEG says of itself, by its markers up to the start of its data; none if it is no whole JPEG.
std::optional<std::array<std::int32_t, 2>> jpeg_size_px(const std::vector<std::uint8_t>& jpeg) noexcept;

// Refuses, beside what every message is checked for, a picture that is not the JPEG of the size that is said, and a tip
// outside it.
template <>
Decoded<camera_picture_t> checked_decode<camera_picture_t>(const void* data, std::size_t size) noexcept;
template <>
std::optional<DecodeError> check_fields<camera_picture_t>(const camera_picture_t& message) noexcept;

}  // namespace bevel::io
