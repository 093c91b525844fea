// SPDX-License-Identifier: MIT
/// \file
/// Reader of MCAP files in memory that reports damage.
///
/// Lengths in the file are compared with the bytes that exist: the reader allocates no memory for a wrong length and
/// reads no byte outside the file. The size of a decompressed chunk is limited. Records are read in the order of the
/// file. The summary is used to continue behind damage and to report how many messages are missing. If the end of the
/// file cuts a chunk off, the records before the cut are read.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::io::mcap {

/// Kinds of damage.
enum class Fault : std::uint8_t {
  magic,        ///< not an MCAP file of version 0: nothing is read
  record,       ///< a length leads beyond the file or the enclosing record, or fields do not fit into a record
  cut,          ///< the end of the file is missing
  crc,          ///< a CRC-32 does not match the bytes
  compression,  ///< the compression of a chunk is neither zstd nor lz4
  channel,      ///< a message belongs to a channel that the file does not define
  missing,      ///< fewer messages or attachments than the summary states
  message,      ///< reserved for the caller: the content of a message is unusable
};

/// Damage of a file.
struct Damage {
  /// One damaged place.
  struct Place {
    Fault fault;           ///< kind of damage
    std::uint64_t offset;  ///< position of the record in the file, in bytes
    std::string what;      ///< description
  };
  std::vector<Place> places;  ///< the first eight of each kind of fault
  std::int64_t more = 0;      ///< number of further places

  /// Adds a place.
  /// @param fault  kind of damage
  /// @param offset  position of the record in the file, in bytes
  /// @param what  description
  void note(Fault fault, std::uint64_t offset, std::string what);
  /// Returns true if no place was added.
  /// @return false if the file is damaged
  bool intact() const { return places.empty(); }
  /// Returns whether a kind of damage occurs.
  /// @param fault  kind of damage
  /// @return true if \ref places contains it
  bool has(Fault fault) const;
  /// Lists the places, one line for each.
  /// @return lines that end with a line feed; "" without damage
  std::string describe() const;
};

/// One message. Its views refer to the file or to a decompressed chunk and are valid until the handler returns.
struct Message {
  std::string_view topic,         ///< topic of the channel
      encoding;                   ///< message encoding of the channel: "json"
  std::uint32_t sequence = 0;     ///< number of the message on its channel
  std::uint64_t log_time_ns = 0;  ///< time of the message, ns since the epoch
  std::string_view data;          ///< encoded message
  std::uint64_t offset = 0;       ///< position in the file in bytes; that of the chunk if the chunk is compressed
};
/// One attachment. Its views refer to the file.
struct Attachment {
  std::string_view name,  ///< file name
      media_type,         ///< media type, "application/toml" for instance
      data;               ///< contents
};
/// Receives the contents of a file. An empty function ignores them.
struct Handler {
  std::function<void(const Message&)> on_message;        ///< called for each message
  std::function<void(const Attachment&)> on_attachment;  ///< called for each attachment
};

/// Reads the messages and attachments of a file in the order of the file.
/// @param file  bytes of the file
/// @param handler  receives the contents; its exceptions are passed on
/// @return the damage of the file
Damage read(std::string_view file, const Handler& handler);

}  // namespace bevel::io::mcap
