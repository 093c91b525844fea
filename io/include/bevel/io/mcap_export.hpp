// SPDX-License-Identifier: MIT
// A recording as an MCAP file for Foxglove, PlotJuggler and scripts, and back: what bevel/io/csv_export.hpp has in a
// folder, in one file, and each message to its last bit. A channel of each kind of message, named as on LCM, of JSON
// messages (bevel/io/json_message.hpp) in the order of the log; log_time and publish_time are the message's utime,
// sequence counts on its channel. config.toml is an attachment.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <bevel/io/file_bytes.hpp>
#include <bevel/io/recording.hpp>

namespace bevel::io {

// JSON of a message takes up to three times what the log has of it.
inline constexpr std::uint64_t kLargestMcap_bytes = 3 * kLargestLog_bytes;

// Throws IoError naming the file if it cannot be written; no file is left then.
void export_mcap(const Recording& recording, const std::string& path);

struct ImportedMcap {
  Recording recording;
  std::string faults;  // one line per fault, "" if intact
  std::string notes;   // one line per channel with fields that are not read
  bool intact() const { return faults.empty(); }
  // The same for stderr: each line opens with the file's name.
  std::string remarks(const std::string& name) const;
};

// Also files that tools/bevel-mcap made before there was this, and such files written anew by other tools. What is
// damaged is left out and reported. Throws ParseError for what is no MCAP, has no message of a recording in it,
// or has a chunk of another compression than zstd and lz4.
ImportedMcap import_mcap(std::string_view file);
// Throws also where the file cannot be read; each message begins with its name.
ImportedMcap import_mcap_file(const std::string& path);
// Whether a path is meant to be one: it ends in .mcap.
bool is_mcap(const std::string& path);

}  // namespace bevel::io
