// SPDX-License-Identifier: MIT
#pragma once
// Wire format of the frame stream: a fixed header, then width*height bytes of gray. Same machine, so native byte order;
// a peer of the other order fails on the magic. Every field is checked before a byte of the picture is read, and
// nothing is allocated from an unchecked size.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace bevel::camera {

struct FrameHeader {
  uint32_t magic = kMagic;
  uint16_t version = kVersion;
  uint16_t header_bytes = kBytes;
  int32_t camera = 0;
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  uint32_t payload_bytes = 0;  ///< width_px * height_px, 8-bit gray
  int64_t seq = 0;
  int64_t capture_utime = 0;

  static constexpr uint32_t kMagic = 0x52465642;  // "BVFR"
  static constexpr uint16_t kVersion = 1;
  static constexpr uint16_t kBytes = 40;
  static constexpr uint32_t kMaxSide_px = 8192;
  static constexpr uint32_t kMaxPayloadBytes = 4096U * 4096U;
};
static_assert(sizeof(FrameHeader) == FrameHeader::kBytes, "no padding may creep into the wire format");

using HeaderBytes = std::array<std::byte, FrameHeader::kBytes>;

HeaderBytes encode(const FrameHeader& header);
FrameHeader decode(const HeaderBytes& bytes);

/// What is wrong with a header, naming the field, the value and what is allowed; nothing if it may be used.
std::optional<std::string> why_unusable(const FrameHeader& header);

}  // namespace bevel::camera
