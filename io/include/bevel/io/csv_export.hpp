// SPDX-License-Identifier: MIT
// A recording as CSV files for spreadsheets and scripts: tip_measurement.csv, tip_heading.csv, actuator_state.csv,
// motion_command.csv, needle_state.csv, needle_truth.csv and config.toml, only those the recording has, and rows.toml
// with the number of rows of each table. The first line has the fields' names with units. Numbers have as many digits
// as it takes to read the same one back. A position's cell is empty along an axis that the measurement does not
// observe. `arrival` numbers tips, headings and axes together in the order in which they arrived.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <bevel/io/recording.hpp>

namespace bevel::io {

// Makes `folder`, and replaces the files of an earlier export in it. All files are written to `folder`.unfinished
// first, so that an export that fails changes nothing. Returns each file with its number of rows. Throws
// Error naming a file it cannot write.
std::vector<std::pair<std::string, std::int64_t>> export_csv(const Recording& recording, const std::string& folder);

// Such a folder back. Not in it: steering targets and status, and when a message was received (it is taken to have been
// at its own time, in the order of arrival). Throws ParseError naming file, line and column for what is no
// export, is incomplete or would be refused by readers.
Recording import_exported(const std::string& folder);
// Whether a folder is meant to be one: it has one of the files.
bool is_exported(const std::string& folder);

// Throws ParseError, and leaves no file.
void write_log(const Recording& recording, const std::string& log_path);

}  // namespace bevel::io
