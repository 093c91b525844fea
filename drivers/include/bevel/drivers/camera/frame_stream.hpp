// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Wire format of the frame stream: a fixed header, then width * height bytes of brightness. Both ends are on one
/// machine, hence native byte order; a peer with another order fails at the magic number. Each field is checked before
/// the image is read, and no memory is allocated from an unchecked size.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace bevel::camera {

/// Header of one frame.
struct FrameHeader {
  uint32_t magic = kMagic;         ///< kMagic
  uint16_t version = kVersion;     ///< kVersion
  uint16_t header_bytes = kBytes;  ///< kBytes
  int32_t camera = 0;              ///< camera number
  uint32_t width_px = 0;           ///< width, px
  uint32_t height_px = 0;          ///< height, px
  uint32_t payload_bytes = 0;      ///< width_px * height_px, 8-bit brightness
  int64_t seq = 0;                 ///< number of the frame
  int64_t capture_utime = 0;       ///< time of exposure, us since the epoch

  static constexpr uint32_t kMagic = 0x52465642;               ///< "BVFR"
  static constexpr uint16_t kVersion = 1;                      ///< version of the format
  static constexpr uint16_t kBytes = 40;                       ///< size of the header, bytes
  static constexpr uint32_t kMaxSide_px = 8192;                ///< largest width and height, px
  static constexpr uint32_t kMaxPayloadBytes = 4096U * 4096U;  ///< largest size of an image, bytes
};
static_assert(sizeof(FrameHeader) == FrameHeader::kBytes, "no padding may creep into the wire format");

/// Encoded header.
using HeaderBytes = std::array<std::byte, FrameHeader::kBytes>;

/// Encodes a header.
/// @param header header
/// @return bytes
HeaderBytes encode(const FrameHeader& header);
/// Decodes a header without checks; why_unusable() checks it.
/// @param bytes encoded header
/// @return header
FrameHeader decode(const HeaderBytes& bytes);

/// Checks a header.
/// @param header header
/// @return text naming the field, the value and what is allowed; empty if the header is valid
std::optional<std::string> why_unusable(const FrameHeader& header);

}  // namespace bevel::camera
