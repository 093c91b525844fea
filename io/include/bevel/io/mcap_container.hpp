// SPDX-License-Identifier: MIT
// What writer and reader of MCAP files share. MCAP is a container of messages on channels, each with a schema
// (https://mcap.dev/spec, version 0): records of an opcode, a 64-bit length and a content, integers little-endian,
// between magic bytes at both ends of the file. Records of schemas, channels and messages stand in chunks, each with a
// CRC-32; what is in the file, and where, is said once more in a summary behind them.
#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace bevel::io::mcap {

enum class Op : std::uint8_t {
  header = 1,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHead = 9;      // opcode, length
inline constexpr std::size_t kMessageHead = 22;    // channel, sequence, two times
inline constexpr std::size_t kFooterContent = 20;  // where summary and summary offsets begin, CRC-32

inline std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

template <class Integer>
void put(char* at, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    at[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
}
template <class Integer>
Integer get(const char* at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) value |= std::uint64_t{static_cast<std::uint8_t>(at[i])} << (8 * i);
  return static_cast<Integer>(value);
}

}  // namespace bevel::io::mcap
