// SPDX-License-Identifier: MIT
/// \file
/// Reader of LCM logs that tolerates damage.
///
/// LCM's own reader trusts the lengths in a log (a data length of 2^31-1 crashes it) and takes damage for the end of
/// the file. This reader accepts an event only if its header is valid and if the bytes after it can follow an event.
/// Otherwise it searches for the next event. It counts all bytes that it skips.
///
/// Format of an event, integers big-endian: uint32 0xEDA1DA01, int64 number, int64 timestamp (us since the epoch),
/// int32 channel length, int32 data length, channel, data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace bevel::io {

/// One event of a log. Its views are valid as long as the bytes that the reader was constructed with.
struct LogEvent {
  std::int64_t number = 0;             ///< number of the event, assigned by the logger
  std::int64_t timestamp_us = 0;       ///< time of receipt by the logger, us since the epoch
  std::string_view channel;            ///< name of the channel, 1 to 63 printable characters
  std::span<const std::uint8_t> data;  ///< encoded message
  std::size_t offset = 0;              ///< position of the event in the log, in bytes
};

/// Damage of a log.
struct LogDamage {
  std::int64_t regions = 0;          ///< number of places where bytes were skipped to find the next event
  std::int64_t skipped_bytes = 0;    ///< number of bytes skipped in these places
  std::int64_t torn_tail_bytes = 0;  ///< size of an event that is cut off by the end of the file

  /// Returns true if no bytes were skipped and no event is cut off.
  /// @return false if a part of the log is unreadable
  bool intact() const { return skipped_bytes == 0 && torn_tail_bytes == 0; }
  /// Returns "intact", or a sentence with the number of skipped and cut bytes.
  /// @return text without a line end
  std::string describe() const;
};

/// Reads events from bytes in memory. It does not throw and does not allocate memory.
class LogReader {
 public:
  /// Starts at the first byte.
  /// @param bytes  a complete log; must outlive the reader and its events
  explicit LogReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  /// Reads the next event.
  /// @return nothing at the end of the log
  std::optional<LogEvent> next();
  /// Returns the damage of the part of the log that has been read.
  /// @return damage up to the last event that next() returned
  const LogDamage& damage() const { return damage_; }

 private:
  bool event_at(std::size_t offset, LogEvent& event, std::size_t& end) const;
  bool can_follow(std::size_t offset, std::int64_t number) const;

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  LogDamage damage_;
};

}  // namespace bevel::io
