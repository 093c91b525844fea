// SPDX-License-Identifier: MIT
/// \file
/// Writer of LCM logs for lcm-logplayer, lcm-logfilter and Python's lcm.EventLog. bevel/io/log_reader.hpp describes the
/// format.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <bevel/io/checked_decode.hpp>

namespace bevel::io {

/// Writes the events of one log in the order of the calls.
class LogWriter {
 public:
  /// Opens the file.
  /// @param path  destination; an existing file is replaced
  /// @throws IoError with the file and the reason if it cannot be opened
  explicit LogWriter(const std::string& path);

  /// Appends an event.
  /// @param timestamp_us  time of receipt, us since the epoch
  /// @param channel  1 to 63 characters
  /// @param data  encoded message
  /// @throws IoError if the length of \p channel is not allowed or if the file cannot be written
  void write(std::int64_t timestamp_us, std::string_view channel, std::span<const std::uint8_t> data);
  /// Appends an event whose data are text, for the CONFIG channel.
  /// @param timestamp_us  time of receipt, us since the epoch
  /// @param channel  1 to 63 characters
  /// @param text  written without a terminating zero
  /// @throws IoError as write()
  void write_text(std::int64_t timestamp_us, std::string_view channel, std::string_view text);

  /// Encodes a message and appends it.
  /// @tparam Message  LCM type
  /// @param timestamp_us  time of receipt, us since the epoch
  /// @param channel  1 to 63 characters
  /// @param message  written without checks of its fields
  /// @throws IoError as write()
  template <class Message>
  void write_message(std::int64_t timestamp_us, std::string_view channel, const Message& message) {
    write(timestamp_us, channel, encode(message));
  }

  /// Flushes and closes the file. The destructor closes the file too, but cannot report errors such as a full disk.
  /// @throws IoError with the file and the reason
  void close();
  /// Returns the number of events written.
  /// @return number of successful calls of write()
  std::int64_t events() const { return events_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::int64_t events_ = 0;
};

/// Writes a log completely or not at all. The log has the name `path.unfinished` until it is complete.
/// @param path  destination; an existing file is replaced
/// @param fill  writes the events; its exceptions are passed on
/// @throws IoError as LogWriter
/// @throws std::filesystem::filesystem_error if the complete log cannot be renamed
void write_whole_log(const std::string& path, const std::function<void(LogWriter&)>& fill);

}  // namespace bevel::io
