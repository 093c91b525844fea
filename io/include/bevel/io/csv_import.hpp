// SPDX-License-Identifier: MIT
// CSV recordings made elsewhere, by a column map (column_map.hpp), into the messages of the contract.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <bevel/io/base_lag.hpp>
#include <bevel/io/column_map.hpp>
#include <bevel/io/entry_frame.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::io {

struct ImportedRecording {
  std::vector<model::ActuatorState> actuators;
  std::vector<model::TipMeasurement> tips;  // only what was seen: information 0 along an axis that was not
  std::vector<model::TipHeading> headings;
  int rows = 0;  // of the tip's file
  int rows_without_data = 0;
  int rows_unsettled = 0;
  int rows_implausible = 0;           // left out, each with a remark
  int base_rows = 0;                  // of the base's file; 0 if it has none
  int rows_without_base = 0;          // of the tip, before the base's first reading or after its last; left out
  std::vector<std::string> left_out;  // a line for each row that is implausible beside its neighbours
  std::string far_tips;               // a sentence on tips farther away than the base moved; "" if there are none
  std::string motion_gap;             // a sentence on the first gap of the base (motion_gap.hpp); "" without a gap
  std::vector<std::string> held;      // a sentence for each column whose value is held between updates
  std::optional<EntryFrame> frame;    // if the map asks for an estimated one
  std::optional<BaseLag> lag;         // of the base relative to the tip; reported, not applied
  std::string lag_setting;            // line of the map that removes the lag: "[base.time] offset_s = -0.31"
  std::string format;                 // what the file was taken for: "',' between cells"
  bool has_clock = true;
  double time_shift_s = 0;  // added where the file's clock begins at 0 or below; a log's times are positive

  bool intact() const { return left_out.empty() && motion_gap.empty(); }
  std::string remarks(const std::string& name) const;  // in lines for stderr; "" if there is nothing
};

// What it returns reads back intact. `base_path`: the file that has the base's columns, if the map says that it is
// another one; the tip keeps its own instants, and whoever reads the log takes the base's position between two of its
// readings by linear interpolation. Throws ParseError naming the file, the line and the column that is missing,
// not a number or out of range, and for motion that no rig or needle makes.
ImportedRecording import_csv(const std::string& csv_path, const ColumnMap& map, const std::string& base_path = "");

// Lines that let a person see a wrong unit, sign or column: duration, rates, extents, total turn, depth.
std::string summary(const ImportedRecording& recording);

// All on their channels, in time order; receipt time is the sample's own. Throws ParseError, and leaves no
// file.
void write_log(const ImportedRecording& recording, const std::string& log_path);

}  // namespace bevel::io
