// SPDX-License-Identifier: MIT
// Writes MCAP files with JSON messages that Foxglove, PlotJuggler and the mcap packages read: chunks without
// compression, each with its CRC-32 and index, attachments, and a summary.
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bevel::io::mcap {

class Writer {
 public:
  // A file that is there whole or not at all: it has another name until close(). Throws IoError naming the
  // file and the reason, as all of these do.
  explicit Writer(const std::string& path);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // `json_schema` as in JSON Schema. Returns the channel's id, the first one's is 1.
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view json_schema);
  void write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns, std::string_view json);
  void attach(std::string_view name, std::string_view media_type, std::string_view data);
  void close();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct Times {
    std::uint64_t first_ns = 0, last_ns = 0;
    void add(std::uint64_t time_ns, bool is_first);
  };
  struct Channel {
    std::string schema, channel;  // their records
    std::uint64_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> in_chunk;  // time and offset of its messages
    bool announced = false;                                         // in a chunk
  };

  void put_bytes(std::string_view bytes);  // without the CRC
  void emit(std::string_view bytes);
  void end_chunk();
  std::string summary(std::uint64_t start) const;

  std::string path_, unfinished_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;  // of all bytes so far
  std::vector<Channel> channels_;
  std::string chunk_;  // records of the open one
  Times chunk_times_, times_;
  std::uint64_t chunk_messages_ = 0, messages_ = 0;
  std::vector<std::string> chunk_indices_, attachment_indices_;  // records
};

}  // namespace bevel::io::mcap
