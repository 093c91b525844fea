// SPDX-License-Identifier: MIT
#pragma once
// Images with an orientation tag, as phones and some cameras write them.
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace bevel::test {

/// A TIFF structure whose only entry is the orientation tag 0x0112 (EXIF 2.32, section 4.6.4).
inline std::string exif_tiff(int orientation, bool little_endian) {
  const auto integer = [little_endian](uint32_t value, int size) {
    std::string out;
    for (int i = 0; i < size; ++i) out += static_cast<char>(value >> (8 * (little_endian ? i : size - 1 - i)) & 0xFF);
    return out;
  };
  return (little_endian ? "II" : "MM") + integer(42, 2) + integer(8, 4) + integer(1, 2) + integer(0x0112, 2) +
         integer(3, 2) + integer(1, 4) + integer(static_cast<uint32_t>(orientation), 2) + integer(0, 2) + integer(0, 4);
}

/// The image as JPEG; with an EXIF segment behind the start marker unless `orientation` is 0.
inline std::vector<uint8_t> jpeg_of(const cv::Mat& image, int orientation, bool little_endian = true) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes);
  if (orientation == 0) return bytes;
  const std::string body = std::string("Exif\0\0", 6) + exif_tiff(orientation, little_endian);
  std::string segment = "\xFF\xE1";
  segment += static_cast<char>((body.size() + 2) >> 8);
  segment += static_cast<char>((body.size() + 2) & 0xFF);
  segment += body;
  bytes.insert(bytes.begin() + 2, segment.begin(), segment.end());
  return bytes;
}

}  // namespace bevel::test
