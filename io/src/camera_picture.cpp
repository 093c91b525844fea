// SPDX-License-Identifier: MIT
#include <bevel/io/camera_picture.hpp>

#include <cmath>

namespace bevel::io {
namespace {

// Of the encoded message before its bytes: fingerprint, two int64, four int32, two doubles, the bytes' number.
constexpr std::size_t kBeforeBytes = 8 + 2 * 8 + 4 * 4 + 2 * 8 + 4;

std::uint64_t read_big_endian(const std::uint8_t* bytes, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = (value << 8U) | bytes[i];
  return value;
}

}  // namespace

std::optional<std::array<std::int32_t, 2>> jpeg_size_px(const std::vector<std::uint8_t>& jpeg) noexcept {
  const std::size_t size = jpeg.size();
  if (size < 4 || jpeg[0] != 0xff || jpeg[1] != 0xd8 || jpeg[size - 2] != 0xff || jpeg[size - 1] != 0xd9) return {};
  // Segments: 0xff, a marker, their length with itself, what they hold. A frame header holds precision, height, width.
  for (std::size_t at = 2; at + 9 < size;) {
    if (jpeg[at] != 0xff) return {};
    const std::uint8_t marker = jpeg[at + 1];
    const std::size_t length = read_big_endian(&jpeg[at + 2], 2);
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame && length >= 8)
      return std::array{static_cast<std::int32_t>(read_big_endian(&jpeg[at + 7], 2)),
                        static_cast<std::int32_t>(read_big_endian(&jpeg[at + 5], 2))};
    if (length < 2 || marker == 0xda) return {};  // data before a frame header
    at += 2 + length;
  }
  return {};
}

template <>
std::optional<DecodeError> check_fields<camera_picture_t>(const camera_picture_t& m) noexcept {
  const auto fault = [](DecodeFault what, const char* field) { return DecodeError{what, field}; };
  if (m.utime <= 0) return fault(DecodeFault::time, "utime");
  if (m.seq < 0) return fault(DecodeFault::out_of_range, "seq");
  if (m.camera < 0) return fault(DecodeFault::out_of_range, "camera");
  if (m.status < 0) return fault(DecodeFault::out_of_range, "status");
  if (m.width_px < 1 || m.width_px > kLargestPicture_px) return fault(DecodeFault::out_of_range, "width_px");
  if (m.height_px < 1 || m.height_px > kLargestPicture_px) return fault(DecodeFault::out_of_range, "height_px");
  for (const double px : m.tip_px)
    if (!std::isfinite(px)) return fault(DecodeFault::not_finite, "tip_px");
  const bool inside =
      m.tip_px[0] >= -0.5 && m.tip_px[0] <= m.width_px - 0.5 && m.tip_px[1] >= -0.5 && m.tip_px[1] <= m.height_px - 0.5;
  if (m.status == 0 && !inside) return fault(DecodeFault::out_of_range, "tip_px");
  if (m.jpeg_size < 1 || m.jpeg_size > kLargestPicture_bytes || m.jpeg.size() != static_cast<std::size_t>(m.jpeg_size))
    return fault(DecodeFault::out_of_range, "jpeg_size");
  if (jpeg_size_px(m.jpeg) != std::array{m.width_px, m.height_px}) return fault(DecodeFault::inconsistent, "jpeg");
  return std::nullopt;
}

template <>
Decoded<camera_picture_t> checked_decode<camera_picture_t>(const void* data, std::size_t size) noexcept {
  Decoded<camera_picture_t> decoded;
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  if (bytes == nullptr || size < kBeforeBytes || size > kBeforeBytes + kLargestPicture_bytes ||
      read_big_endian(bytes + kBeforeBytes - 4, 4) != size - kBeforeBytes) {
    decoded.error = DecodeError{DecodeFault::size, ""};
    return decoded;
  }
  if (read_big_endian(bytes, 8) != static_cast<std::uint64_t>(camera_picture_t::getHash())) {
    decoded.error = DecodeError{DecodeFault::fingerprint, ""};
    return decoded;
  }
  // The bytes are as many as are there: the generated decoder makes room for no more than the message has.
  if (decoded.message.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size))
    decoded.error = DecodeError{DecodeFault::size, ""};
  else
    decoded.error = check_fields(decoded.message);
  if (decoded.error) decoded.message = camera_picture_t{};
  return decoded;
}

}  // namespace bevel::io
