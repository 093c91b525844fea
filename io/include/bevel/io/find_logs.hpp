// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Expansion of paths into logs, and the names of their results.
#include <string>
#include <vector>

namespace bevel::io {

/// Returns whether a file name is one that lcm-logger gives to logs: `*.lcm`, `lcmlog-*`, each also with the number of
/// a rotated, split or incremented log (`rec.lcm.00`, `lcmlog-2026-03-02.01`).
/// @param file_name  name without folders
/// @return false for other names
bool is_log_name(const std::string& file_name);

/// Expands folders into the logs in them, sorted by name, numbers in names by value.
///
/// In a folder a log is a file with a log's name (is_log_name), or a file whose name ends in a number or has no
/// extension and whose content starts as a log does (`lcm-logger -i rec` writes `rec.00`). Files that are given are
/// returned as they are.
/// @param paths  logs and folders
/// @return paths of the logs
/// @throws IoError for a path that does not exist, a folder without a log, a log that is given twice (also as
/// a file of a folder), or a log whose name without the extension has only dots
std::vector<std::string> find_logs(const std::vector<std::string>& paths);

/// Returns a name for the results of each log; no two are equal.
///
/// The name is the file's without its extension, but with the number of a rotated log. Names that would be equal get
/// the file's whole name, or as many folders of the path as it takes to tell them apart: `monday_rec01` and
/// `tuesday_rec01`.
/// @param logs  paths of different files or folders
/// @return one name for each log, in the same order
std::vector<std::string> result_names(const std::vector<std::string>& logs);

}  // namespace bevel::io
