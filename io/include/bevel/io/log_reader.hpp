// SPDX-License-Identifier: MIT
// The one reader of LCM logs. LCM's own trusts the lengths in a log (a data length of 2^31-1 crashes it) and takes
// damage for the end of the file. This one believes an event only if its header is possible and something that can
// follow an event follows it; otherwise it looks for the next one, and accounts for every byte.
//
// Format of an event, integers big-endian: uint32 0xEDA1DA01, int64 number, int64 timestamp (us since the epoch),
// int32 channel length, int32 data length, channel, data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace bevel::io {

// Views into the log, valid as long as the bytes under the reader.
struct LogEvent {
  std::int64_t number = 0;
  std::int64_t timestamp_us = 0;  // when the logger received it
  std::string_view channel;
  std::span<const std::uint8_t> data;
  std::size_t offset = 0;  // of the event in the file
};

struct LogDamage {
  std::int64_t regions = 0;  // places where bytes had to be skipped to find the next event
  std::int64_t skipped_bytes = 0;
  std::int64_t torn_tail_bytes = 0;  // an event cut off by the end of the file

  bool intact() const { return skipped_bytes == 0 && torn_tail_bytes == 0; }
  std::string describe() const;  // "intact", or what is wrong with it
};

// Reads events from bytes in memory. Never throws, never allocates.
class LogReader {
 public:
  explicit LogReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::optional<LogEvent> next();
  const LogDamage& damage() const { return damage_; }  // of what has been read so far

 private:
  bool event_at(std::size_t offset, LogEvent& event, std::size_t& end) const;
  bool can_follow(std::size_t offset, std::int64_t number) const;

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  LogDamage damage_;
};

}  // namespace bevel::io
