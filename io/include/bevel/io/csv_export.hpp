// SPDX-License-Identifier: MIT
/// \file
/// Export of recordings as a folder of CSV files for spreadsheets and scripts, and import of such folders.
///
/// The folder contains tip_measurement.csv, tip_heading.csv, actuator_state.csv, motion_command.csv, needle_state.csv,
/// needle_truth.csv and config.toml, as far as the recording has them, and rows.toml with the number of rows of each
/// table. The first line of a table contains the names of the fields with units (csv_columns.hpp). Numbers have as many
/// digits as are needed to read the same number back. The cell of a position is empty along an axis without
/// information. The column `arrival` numbers tips, headings and actuator states together in the order of arrival.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <bevel/io/recording.hpp>

namespace bevel::io {

/// Writes a recording to a folder. The files are written to `folder`.unfinished first, so that an export that fails
/// changes nothing.
/// @param recording  recording to export
/// @param folder  created if it does not exist; files of an earlier export in it are replaced
/// @return path and number of rows of each table; empty, and no folder, if the recording has no samples
/// @throws IoError with the file that cannot be written
/// @throws std::filesystem::filesystem_error if a folder cannot be created or a file cannot be renamed
std::vector<std::pair<std::string, std::int64_t>> export_csv(const Recording& recording, const std::string& folder);

/// Reads a folder that export_csv() wrote.
///
/// The folder does not contain steering targets, process status and times of receipt. The time of receipt of a message
/// is its own time, in the order of arrival. Tables without a column `arrival` are sorted by time.
/// @param folder  path of the folder
/// @return the recording, without implausibility checks
/// @throws ParseError with the file, the line and the column if the folder is not an export, if it is incomplete, or if
/// readers would reject a message
/// @throws IoError if a file cannot be read
Recording import_exported(const std::string& folder);
/// Returns whether a folder contains a table of an export.
/// @param folder  path of the folder
/// @return true if at least one table exists; its contents are not checked
bool is_exported(const std::string& folder);

/// Writes a log completely or not at all, with the messages in the order of log_order().
/// @param recording  recording to write; steering targets are not written
/// @param log_path  destination; an existing file is replaced
/// @throws IoError with the file and the reason
void write_log(const Recording& recording, const std::string& log_path);

}  // namespace bevel::io
