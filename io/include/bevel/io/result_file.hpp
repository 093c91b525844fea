// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Result files. A file gets its name once it is complete and on the disk, so that a full disk or a program that ends
/// leaves the previous file, or none.
#include <string>
#include <string_view>

namespace bevel::io {

/// File with a temporary name in the folder of its destination. It is removed with this object unless it was renamed.
class PendingFile {
 public:
  /// Writes \p contents and synchronises them with the disk.
  /// @param path  destination; an existing symbolic link is followed
  /// @param contents  bytes of the file
  /// @throws IoError with \p path and the reason if the folder cannot be written or the disk is full
  PendingFile(const std::string& path, std::string_view contents);
  /// Removes the file if it has no final name.
  ~PendingFile();
  /// Takes the file over.
  /// @param other  has no file afterwards
  PendingFile(PendingFile&& other) noexcept;
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;
  PendingFile& operator=(PendingFile&&) = delete;

  /// Gives the file its final name; a file of that name is replaced.
  /// @throws IoError if the name belongs to a directory, for instance
  void take_place();

 private:
  std::string place_, path_;
};

/// Checks that a file can be made at \p path; one that is there keeps its contents.
/// @param path  destination
/// @throws IoError as PendingFile
void require_writable(const std::string& path);

/// Writes a file completely or not at all. A device or FIFO at \p path is written to directly.
/// @param path  destination; an existing file is replaced
/// @param contents  bytes of the file
/// @throws IoError as PendingFile
void write_result_file(const std::string& path, std::string_view contents);

}  // namespace bevel::io
