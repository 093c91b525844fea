// A recording as CSV files for spreadsheets and scripts: tip_measurement.csv, tip_heading.csv, actuator_state.csv,
// motion_command.csv, needle_state.csv, needle_truth.csv; only those the recording has. First line: the fields' names,
// units in them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "io/recording.hpp"

namespace bevel::io {

// Makes `folder`. Returns each file with its number of rows. Throws std::runtime_error naming a file it cannot write.
std::vector<std::pair<std::string, std::int64_t>> export_csv(const Recording& recording, const std::string& folder);

}  // namespace bevel::io
