// SPDX-License-Identifier: MIT
/// \file
/// Import of CSV recordings of other programs by a column map (column_map.hpp).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <bevel/io/base_lag.hpp>
#include <bevel/io/column_map.hpp>
#include <bevel/io/entry_frame.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::io {

/// Result of import_csv(): samples in the order of time, omitted rows and findings.
struct ImportedRecording {
  std::vector<model::ActuatorState> actuators;  ///< positions in mm and rad; rates are differences of the positions
  std::vector<model::TipMeasurement> tips;      ///< in {A}, mm; information is 0 along axes without a measurement
  std::vector<model::TipHeading> headings;      ///< unit vectors in {A}
  int rows = 0;                                 ///< rows of the tip's file
  int rows_without_data = 0;                    ///< rows without usable cells by the column map
  int rows_unsettled = 0;                       ///< rows between the steps of a stepwise insertion; left out
  int rows_implausible = 0;                     ///< rows that are left out, each with a line in \ref left_out
  int base_rows = 0;                            ///< rows of the file of the actuator motion; 0 without such a file
  int rows_without_base = 0;  ///< tip measurements before the first or after the last actuator position; left out
  std::vector<std::string> left_out;  ///< one line for each row that is implausible compared with its neighbours
  std::string far_tips;               ///< sentence on tips farther away than the actuator moved; "" without any
  std::string motion_gap;         ///< sentence on the first gap of the actuator motion (motion_gap.hpp); "" without any
  std::vector<std::string> held;  ///< sentence for each column whose value is held between updates (held_values.hpp)
  std::optional<EntryFrame> frame;  ///< estimated frame {A}, if the column map asks for it
  std::optional<BaseLag> lag;       ///< time lag of the actuator positions relative to the tip; reported, not applied
  std::string lag_setting;          ///< line of the column map that removes the lag: "[base.time] offset_s = -0.31"
  std::string format;               ///< detected format of the file: "',' between cells"
  bool has_clock = true;            ///< false for stepwise insertions, whose times are meaningless
  double time_shift_s = 0;  ///< added to all times if the file's clock begins at 0 or below, s; log times are positive

  /// Returns true if no row is implausible and the actuator motion has no gap.
  /// @return false if the recording is incomplete
  bool intact() const { return left_out.empty() && motion_gap.empty(); }
  /// Formats the findings and the omitted rows for stderr.
  /// @param name  name of the file, at the start of the lines that concern the whole file
  /// @return lines that end with a line feed; "" if there is nothing to report
  std::string remarks(const std::string& name) const;
};

/// Reads a recording from one or two CSV files. A log written from the result is intact when read.
///
/// Tip measurements keep their own times. Readers of the log interpolate the actuator positions linearly.
/// @param csv_path  file with the columns of the tip
/// @param map  meaning of the columns
/// @param base_path  file with the columns of insertion and rotation, if \p map has [base.time]; else empty
/// @return the recording, with at least one actuator state
/// @throws ParseError with the file, the line and the column if a cell is missing, not a number or out of range; for a
/// motion that no actuator or needle makes; for more than one insertion; if the files have no time in common
/// @throws IoError if a file cannot be read
ImportedRecording import_csv(const std::string& csv_path, const ColumnMap& map, const std::string& base_path = "");

/// Summarises a recording so that a wrong unit, sign or column is visible: duration, rates, extents, total rotation,
/// depth.
/// @param recording  result of import_csv()
/// @return lines that end with a line feed
std::string summary(const ImportedRecording& recording);

/// Writes a log completely or not at all. The messages are in the order of time; the time of receipt of each message is
/// its own time.
/// @param recording  result of import_csv()
/// @param log_path  destination; an existing file is replaced
/// @throws IoError with the file and the reason
void write_log(const ImportedRecording& recording, const std::string& log_path);

}  // namespace bevel::io
