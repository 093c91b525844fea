// SPDX-License-Identifier: MIT
/// \file
/// Export of a recording as one MCAP file for Foxglove, PlotJuggler and scripts, and import of such files.
///
/// The file contains the same data as an export to CSV (bevel/io/csv_export.hpp). Each message is restored bit by bit.
/// Each type of message has a channel with the name of its LCM channel. Its messages are JSON
/// (bevel/io/json_message.hpp) in the order of the log. log_time and publish_time are the `utime` of the message;
/// sequence counts the messages of the channel. config.toml is an attachment.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <bevel/io/file_bytes.hpp>
#include <bevel/io/recording.hpp>

namespace bevel::io {

/// Largest MCAP file that is read, bytes. A message as JSON takes up to three times the bytes that it takes in a log.
inline constexpr std::uint64_t kLargestMcap_bytes = 3 * kLargestLog_bytes;

/// Writes a recording as an MCAP file, completely or not at all.
/// @param recording  recording to export
/// @param path  destination; an existing file is replaced
/// @throws IoError with the file if it cannot be written
/// @throws ParseError if a number is not finite
void export_mcap(const Recording& recording, const std::string& path);

/// Result of import_mcap().
struct ImportedMcap {
  Recording recording;  ///< the messages that were read, without implausibility checks
  std::string faults;   ///< one line for each fault; "" if the file is intact
  std::string notes;    ///< one line for each channel with fields that are not read
  /// Returns true if the file has no fault.
  /// @return false if a part of the file was left out
  bool intact() const { return faults.empty(); }
  /// Formats faults and notes for stderr.
  /// @param name  name of the file, at the start of each line
  /// @return lines that end with a line feed; "" if there is nothing to report
  std::string remarks(const std::string& name) const;
};

/// Reads an MCAP file from memory.
///
/// It accepts files of export_mcap(), those of the older tools/bevel-mcap, and files that other tools made from them.
/// Damaged parts are left out and reported.
/// @param file  bytes of the file
/// @return the recording and the faults of the file
/// @throws ParseError if the bytes are not MCAP version 0, contain no usable message of a recording, have messages in
/// another encoding than json, or have a chunk with another compression than zstd and lz4
ImportedMcap import_mcap(std::string_view file);
/// Reads an MCAP file.
/// @param path  a regular file of at most kLargestMcap_bytes
/// @return the recording and the faults of the file
/// @throws IoError with \p path if the file cannot be read
/// @throws ParseError with \p path as import_mcap()
ImportedMcap import_mcap_file(const std::string& path);
/// Returns whether a path has the extension .mcap.
/// @param path  path of a file, which need not exist
/// @return true if it ends in .mcap
bool is_mcap(const std::string& path);

}  // namespace bevel::io
