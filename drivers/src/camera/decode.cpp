// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/decode.hpp>

#include <algorithm>
#include <bit>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string_view>
#include <vector>

namespace bevel::camera {
namespace {

using Bytes = std::span<const uint8_t>;

// An unsigned integer of `size` bytes; nothing past the end.
std::optional<uint32_t> integer_at(Bytes bytes, size_t at, size_t size, bool little_endian) {
  if (at > bytes.size() || bytes.size() - at < size) return std::nullopt;
  uint32_t value = 0;
  for (size_t i = 0; i < size; ++i) value = value << 8 | bytes[at + (little_endian ? size - 1 - i : i)];
  return value;
}

bool has_text(Bytes bytes, size_t at, std::string_view text) {
  return at <= bytes.size() && bytes.size() - at >= text.size() &&
         std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char c, uint8_t b) { return static_cast<uint8_t>(c) == b; });
}

struct Tag {
  size_t at = 0;    // of the value
  size_t size = 2;  // bytes
  bool little_endian = false;
  uint32_t value = 1;
};

// The orientation in the first directory of a TIFF structure that begins at `start`.
std::optional<Tag> tag_in_tiff(Bytes bytes, size_t start) {
  constexpr uint32_t kOrientation = 0x0112, kShort = 3, kLong = 4;
  constexpr size_t kEntryBytes = 12;
  const bool little = has_text(bytes, start, {"II*\0", 4});
  if (!little && !has_text(bytes, start, {"MM\0*", 4})) return std::nullopt;
  const auto offset = integer_at(bytes, start + 4, 4, little);
  if (!offset) return std::nullopt;
  const size_t directory = start + *offset;
  const auto entries = integer_at(bytes, directory, 2, little);
  for (size_t i = 0; entries && i < *entries; ++i) {
    const size_t entry = directory + 2 + i * kEntryBytes;
    const auto tag = integer_at(bytes, entry, 2, little), type = integer_at(bytes, entry + 2, 2, little);
    if (!tag || !type) return std::nullopt;
    if (*tag != kOrientation) continue;
    if (*type != kShort && *type != kLong) return std::nullopt;
    const size_t size = *type == kShort ? 2 : 4;
    const auto value = integer_at(bytes, entry + 8, size, little);
    if (!value || *value < 1 || *value > 8) return std::nullopt;
    return Tag{entry + 8, size, little, *value};
  }
  return std::nullopt;
}

std::optional<Tag> tag_in_jpeg(Bytes bytes) {
  constexpr uint32_t kApp1 = 0xE1, kStartOfScan = 0xDA;
  for (size_t at = 2; at + 4 <= bytes.size() && bytes[at] == 0xFF;) {
    if (bytes[at + 1] == 0xFF) {  // fill byte
      ++at;
      continue;
    }
    const uint32_t marker = bytes[at + 1], length = *integer_at(bytes, at + 2, 2, false);
    if (marker == kStartOfScan || length < 2) break;
    if (marker == kApp1 && has_text(bytes, at + 4, {"Exif\0\0", 6}))
      if (const auto tag = tag_in_tiff(bytes, at + 10)) return tag;
    at += 2 + length;
  }
  return std::nullopt;
}

std::optional<Tag> tag_in_png(Bytes bytes) {
  for (size_t at = 8; at + 8 <= bytes.size();) {
    if (has_text(bytes, at + 4, "eXIf")) return tag_in_tiff(bytes, at + 8);
    at += size_t{12} + *integer_at(bytes, at, 4, false);  // length, type, data, checksum
  }
  return std::nullopt;
}

// Bits that the samples use, rounded up to a depth that sensors have. Samples whose low bits are all zero are
// left-justified: they fill the 16 bits from the top.
int bits_in_use(const cv::Mat& samples) {
  unsigned any = 0;
  for (int row = 0; row < samples.rows; ++row)
    for (const uint16_t* p = samples.ptr<uint16_t>(row); p != samples.ptr<uint16_t>(row) + samples.cols; ++p) any |= *p;
  if (any != 0 && std::countr_zero(any) >= 2) return 16;
  const int width = std::bit_width(any);
  return width <= 8 ? 8 : (width + 1) / 2 * 2;
}

cv::Mat decode(Bytes bytes, int flags) {
  try {
    // OpenCV has no matrix of const bytes; the bytes are only read.
    return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<uint8_t*>(bytes.data())),
                        flags | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {  // larger than OpenCV reads
    return {};
  }
}

}  // namespace

DecodedImage decode_gray(std::span<const uint8_t> bytes, int least_bits) {
  constexpr size_t kLargest_bytes = 0x7FFFFFFF;  // cv::Mat counts columns in int
  DecodedImage out;
  if (bytes.empty() || bytes.size() > kLargest_bytes) return out;
  const bool jpeg = has_text(bytes, 0, "\xFF\xD8"), png = has_text(bytes, 0, "\x89PNG\r\n\x1A\n");
  const auto tag = jpeg ? tag_in_jpeg(bytes) : png ? tag_in_png(bytes) : tag_in_tiff(bytes, 0);
  if (tag) out.orientation = static_cast<int>(tag->value);
  std::vector<uint8_t> untagged;
  if (tag && tag->value != 1 && !jpeg && !png) {
    // OpenCV's TIFF decoder applies the tag whatever the flags are.
    untagged.assign(bytes.begin(), bytes.end());
    for (size_t i = 0; i < tag->size; ++i) untagged[tag->at + i] = 0;
    untagged[tag->little_endian ? tag->at : tag->at + tag->size - 1] = 1;
    bytes = untagged;
  }
  out.gray = decode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  if (out.gray.depth() == CV_16U) {
    out.bits = std::clamp(std::max(bits_in_use(out.gray), least_bits), 8, 16);
    out.gray.convertTo(out.gray, CV_8U, 255.0 / ((1 << out.bits) - 1));
  } else if (!out.gray.empty() && out.gray.depth() != CV_8U) {
    out.gray = decode(bytes, cv::IMREAD_GRAYSCALE);
  }
  return out;
}

DecodedImage read_gray(const std::filesystem::path& file, int least_bits) {
  std::ifstream in(file, std::ios::binary);
  const std::vector<char> text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  return decode_gray({reinterpret_cast<const uint8_t*>(text.data()), text.size()}, least_bits);
}

std::string orientation_remark(const std::string& name, int orientation) {
  if (orientation == 1) return {};
  return "'" + name + "' carries orientation tag " + std::to_string(orientation) +
         "; the image is not rotated: rows and columns are those of the sensor";
}

}  // namespace bevel::camera
