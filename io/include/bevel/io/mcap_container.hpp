// SPDX-License-Identifier: MIT
/// \file
/// Definitions shared by the writer and the reader of MCAP files.
///
/// MCAP is a container of messages on channels, each with a schema (https://mcap.dev/spec, version 0). A file consists
/// of records between magic bytes at both ends. A record is an opcode, a 64-bit length and a content; integers are
/// little-endian. Records of schemas, channels and messages are in chunks, each with a CRC-32. A summary behind the
/// data repeats schemas and channels and lists the positions of the chunks.
#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace bevel::io::mcap {

/// Opcodes of records.
enum class Op : std::uint8_t {
  header = 1,        ///< profile and library that wrote the file
  footer,            ///< positions of the summary, and its CRC-32
  schema,            ///< name, encoding and text of a schema
  channel,           ///< topic, encoding and schema of a channel
  message,           ///< one message
  chunk,             ///< schemas, channels and messages, with a CRC-32
  message_index,     ///< times and positions of the messages of one channel in the chunk before it
  chunk_index,       ///< times and position of a chunk
  attachment,        ///< a file
  attachment_index,  ///< position of an attachment
  statistics,        ///< numbers of messages, schemas, channels, attachments and chunks
  metadata,          ///< named texts
  metadata_index,    ///< position of metadata
  summary_offset,    ///< position of the records of one opcode in the summary
  data_end,          ///< CRC-32 of all bytes before it
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};  ///< first and last bytes of a file
inline constexpr std::size_t kRecordHead = 9;                  ///< bytes of opcode and length
inline constexpr std::size_t kMessageHead = 22;                ///< bytes of channel, sequence and two times
inline constexpr std::size_t kFooterContent =
    20;  ///< bytes of the positions of summary and summary offsets, and CRC-32

/// Computes a CRC-32.
/// @param bytes  any number of bytes
/// @param before  CRC-32 of the bytes before these, to continue it
/// @return CRC-32 of all bytes
inline std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Writes an integer in little-endian order.
/// @tparam Integer  type, whose size is the number of bytes
/// @param at  first byte
/// @param value  value to write
template <class Integer>
void put(char* at, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    at[i] = static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
}
/// Reads an integer in little-endian order.
/// @tparam Integer  type, whose size is the number of bytes
/// @param at  first byte
/// @return the value
template <class Integer>
Integer get(const char* at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) value |= std::uint64_t{static_cast<std::uint8_t>(at[i])} << (8 * i);
  return static_cast<Integer>(value);
}

}  // namespace bevel::io::mcap
