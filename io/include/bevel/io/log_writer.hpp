// SPDX-License-Identifier: MIT
// Writes LCM logs that lcm-logplayer, lcm-logfilter and Python's lcm.EventLog read. Format: bevel/io/log_reader.hpp.
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

class LogWriter {
 public:
  // Replaces an existing file. Throws IoError naming the file and the reason, as all of these do.
  explicit LogWriter(const std::string& path);

  void write(std::int64_t timestamp_us, std::string_view channel, std::span<const std::uint8_t> data);
  void write_text(std::int64_t timestamp_us, std::string_view channel, std::string_view text);

  template <class Message>
  void write_message(std::int64_t timestamp_us, std::string_view channel, const Message& message) {
    write(timestamp_us, channel, encode(message));
  }

  // Flushes and reports what the destructor would have to keep to itself, a full disk above all.
  void close();
  std::int64_t events() const { return events_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::int64_t events_ = 0;
};

// A log that is there whole or not at all: `fill` writes it under another name first. Throws what `fill` throws, and
// Error as above.
void write_whole_log(const std::string& path, const std::function<void(LogWriter&)>& fill);

}  // namespace bevel::io
