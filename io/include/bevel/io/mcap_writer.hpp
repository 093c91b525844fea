// SPDX-License-Identifier: MIT
/// \file
/// Writer of MCAP files with JSON messages for Foxglove, PlotJuggler and the mcap packages: chunks without compression,
/// each with its CRC-32 and index, attachments, and a summary.
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

/// Writes one MCAP file completely or not at all. The file has the name `path.unfinished` until close().
class Writer {
 public:
  /// Opens the file and writes its header.
  /// @param path  destination; close() replaces an existing file
  /// @throws IoError with the file and the reason
  explicit Writer(const std::string& path);
  /// Removes the file if it was not closed.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Adds a channel with its schema.
  /// @param topic  name of the channel
  /// @param schema_name  name of the schema
  /// @param json_schema  text of the schema, JSON Schema
  /// @return id of the channel; the ids count from 1
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view json_schema);
  /// Appends a message.
  /// @param channel  id from add_channel()
  /// @param sequence  number of the message on its channel
  /// @param time_ns  log time and publish time, ns since the epoch
  /// @param json  one JSON object
  /// @throws IoError with the file and the reason
  /// @throws std::out_of_range if the channel does not exist
  void write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns, std::string_view json);
  /// Appends an attachment.
  /// @param name  file name
  /// @param media_type  media type, "application/toml" for instance
  /// @param data  contents
  /// @throws IoError with the file and the reason
  void attach(std::string_view name, std::string_view media_type, std::string_view data);
  /// Writes the summary, closes the file and gives it its final name.
  /// @throws IoError with the file and the reason
  /// @throws std::filesystem::filesystem_error if the file cannot be renamed
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
