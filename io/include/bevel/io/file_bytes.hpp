// SPDX-License-Identifier: MIT
// The one way in which a file is read: a regular file, whole, into memory of this program.
//
// Regular files only: a FIFO keeps whoever opens it waiting for a writer, /dev/zero never ends. read() and not mmap():
// a file cut by someone else while it is mapped ends the program with SIGBUS; read, it is merely shorter than it was,
// and that is said.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::io {

// A day of recording at 80 messages a second takes 1 GiB.
inline constexpr std::uint64_t kLargestLog_bytes = std::uint64_t{1} << 30U;
// Text (TOML, CSV) is written by hand or a row at a time.
inline constexpr std::uint64_t kLargestText_bytes = std::uint64_t{64} << 20U;

// Throws IoError naming the file, what it is and what is allowed: for what is not there or not a regular
// file (told before it is opened), and for more than `largest_bytes`.
class FileBytes {
 public:
  explicit FileBytes(const std::string& path, std::uint64_t largest_bytes = kLargestLog_bytes);
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  // "", or how the file changed while it was read; bytes() is what was got.
  const std::string& change() const { return change_; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::string change_;
};

// A text file whole: one that changes while it is read is refused too, since half a configuration is none.
std::string read_text_file(const std::string& path);

}  // namespace bevel::io
