// SPDX-License-Identifier: MIT
// Reads what is in an MCAP file, from bytes in memory, and reports what cannot be read. Lengths in the file are
// compared with the bytes that are there: none is used for an allocation, none leads outside. The size of a compressed
// chunk is limited. Records are read in the order of the file; the summary serves to continue behind damage, and to
// report how much is missing. Of a chunk that the end of the file cuts off, the records before the cut are read.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::io::mcap {

enum class Fault : std::uint8_t {
  magic,        // not an MCAP file of version 0: nothing is read
  record,       // a length that leads beyond the file or what the record is in, or fields that do not fit into it
  cut,          // the file does not end as one does
  crc,          // a CRC-32 that is not that of the bytes
  compression,  // of a chunk, neither zstd nor lz4
  channel,      // a message of a channel that the file does not say
  missing,      // fewer messages or attachments than the summary says
  message,      // for the caller: what a message says cannot be used
};

struct Damage {
  struct Place {
    Fault fault;
    std::uint64_t offset;  // of the record, from the beginning of the file
    std::string what;
  };
  std::vector<Place> places;  // the first few, and one of each fault
  std::int64_t more = 0;      // those that were not kept

  void note(Fault fault, std::uint64_t offset, std::string what);
  bool intact() const { return places.empty(); }
  bool has(Fault fault) const;
  std::string describe() const;  // a line a place
};

// Views into the file, or into a decompressed chunk: valid until the handler returns.
struct Message {
  std::string_view topic, encoding;  // the channel's: "json"
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::string_view data;
  std::uint64_t offset = 0;  // in the file; that of the chunk if it is compressed
};
struct Attachment {
  std::string_view name, media_type, data;
};
struct Handler {
  std::function<void(const Message&)> on_message;
  std::function<void(const Attachment&)> on_attachment;
};

// In the order of the file. Throws what the handler throws.
Damage read(std::string_view file, const Handler& handler);

}  // namespace bevel::io::mcap
