// SPDX-License-Identifier: MIT
/// \file
/// Reads complete regular files into memory.
///
/// Other files are rejected: to open a FIFO blocks until a writer opens it, and /dev/zero never ends. The file is read
/// with read() and not mapped with mmap(): if another program shortens a mapped file, SIGBUS ends this program. A file
/// that is shortened while it is read yields fewer bytes, which is reported.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::io {

/// Largest log, bytes: 1 GiB. A day of recording at 80 messages per second takes as much.
inline constexpr std::uint64_t kLargestLog_bytes = std::uint64_t{1} << 30U;
/// Largest text file (TOML, CSV), bytes: 64 MiB.
inline constexpr std::uint64_t kLargestText_bytes = std::uint64_t{64} << 20U;

/// Contents of a file.
class FileBytes {
 public:
  /// Reads a file.
  /// @param path  a regular file; other kinds are rejected before they are opened
  /// @param largest_bytes  largest size allowed
  /// @throws IoError with the file, its kind or size and what is allowed
  explicit FileBytes(const std::string& path, std::uint64_t largest_bytes = kLargestLog_bytes);
  /// Returns the bytes that were read.
  /// @return view that is valid as long as this object
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  /// Returns how the file changed while it was read; "" if it did not.
  /// @return a sentence with both sizes
  const std::string& change() const { return change_; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::string change_;
};

/// Reads a text file. A file that changes while it is read is rejected, since a partial configuration is not usable.
/// @param path  a regular file of at most kLargestText_bytes
/// @return the text
/// @throws IoError as FileBytes, and if the file changed
std::string read_text_file(const std::string& path);

}  // namespace bevel::io
