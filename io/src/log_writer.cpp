// SPDX-License-Identifier: MIT
#include <bevel/io/log_writer.hpp>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <bevel/error.hpp>

namespace bevel::io {
namespace {

template <class Integer>
void put_big_endian(std::uint8_t* at, Integer value) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    at[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * (sizeof(Integer) - 1 - i)));
  }
}

}  // namespace

LogWriter::LogWriter(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "wbe")) {
  if (!file_) throw IoError(path + ": cannot be written: " + std::strerror(errno));
}

void LogWriter::write(std::int64_t timestamp_us, std::string_view channel, std::span<const std::uint8_t> data) {
  if (channel.empty() || channel.size() > 63) {
    throw IoError("channel \"" + std::string(channel) + "\": 1 to 63 characters are allowed");
  }
  std::array<std::uint8_t, 28> header{};
  put_big_endian(header.data(), std::uint32_t{0xEDA1DA01});
  put_big_endian(header.data() + 4, events_);
  put_big_endian(header.data() + 12, timestamp_us);
  put_big_endian(header.data() + 20, static_cast<std::int32_t>(channel.size()));
  put_big_endian(header.data() + 24, static_cast<std::int32_t>(data.size()));
  const auto put = [this](const void* bytes, std::size_t size) {
    if (size > 0 && std::fwrite(bytes, 1, size, file_.get()) != size) {
      throw IoError(path_ + ": cannot be written: " + std::strerror(errno));
    }
  };
  put(header.data(), header.size());
  put(channel.data(), channel.size());
  put(data.data(), data.size());
  ++events_;
}

void LogWriter::write_text(std::int64_t timestamp_us, std::string_view channel, std::string_view text) {
  write(timestamp_us, channel, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void LogWriter::close() {
  if (!file_) return;
  if (std::fclose(file_.release()) != 0) throw IoError(path_ + ": cannot be written: " + std::strerror(errno));
}

void write_whole_log(const std::string& path, const std::function<void(LogWriter&)>& fill) {
  const std::string unfinished = path + ".unfinished";
  try {
    LogWriter log(unfinished);
    fill(log);
    log.close();
    std::filesystem::rename(unfinished, path);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw;
  }
}

}  // namespace bevel::io
