// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/frame_stream.hpp>

#include <bit>

namespace bevel::camera {

HeaderBytes encode(const FrameHeader& header) { return std::bit_cast<HeaderBytes>(header); }

FrameHeader decode(const HeaderBytes& bytes) { return std::bit_cast<FrameHeader>(bytes); }

std::optional<std::string> why_unusable(const FrameHeader& h) {
  const auto complain = [](const char* field, uint64_t value, const std::string& allowed) {
    return std::string("frame header: ") + field + " is " + std::to_string(value) + ", allowed " + allowed;
  };
  if (h.magic != FrameHeader::kMagic) return complain("magic", h.magic, std::to_string(FrameHeader::kMagic));
  if (h.version != FrameHeader::kVersion) return complain("version", h.version, std::to_string(FrameHeader::kVersion));
  if (h.header_bytes != FrameHeader::kBytes)
    return complain("header_bytes", h.header_bytes, std::to_string(FrameHeader::kBytes));
  const std::string side = "1 to " + std::to_string(FrameHeader::kMaxSide_px);
  if (h.width_px < 1 || h.width_px > FrameHeader::kMaxSide_px) return complain("width_px", h.width_px, side);
  if (h.height_px < 1 || h.height_px > FrameHeader::kMaxSide_px) return complain("height_px", h.height_px, side);
  const uint64_t expected = uint64_t{h.width_px} * h.height_px;
  if (expected > FrameHeader::kMaxPayloadBytes)
    return complain("width_px*height_px", expected, "up to " + std::to_string(FrameHeader::kMaxPayloadBytes));
  if (h.payload_bytes != expected) return complain("payload_bytes", h.payload_bytes, std::to_string(expected));
  return std::nullopt;
}

}  // namespace bevel::camera
