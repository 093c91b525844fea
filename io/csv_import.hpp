// CSV recordings made elsewhere, by a column map, into the messages of the contract.
//
// The map (TOML; docs/import/bwh.toml is one):
//   [time]       seconds = "..."  nanoseconds = "..." (optional), or rate_hz = 30.0 (rows are that far apart);
//                left out with stops = true
//   [tip]        axes = ["Tip z", "-Tip x", "-Tip y"]: the column, with its sign, that each axis of {A} is
//                origin = the same for the entry point (optional): its first row without a zero; default 0
//                sigma_mm = [x, y, z]: standard deviations; 0 for an axis that was not measured
//                heading = [x, y, z] (optional): columns, with signs as axes, of the unit vector along the needle's tip
//                heading_sd_rad: its standard deviation to any side; required with heading
//   [insertion]  column = "-Base y"; settled = true or stops = true (see below)
//   [rotation]   column (optional), in rad unless scale says otherwise; default: no rotation
//   [rows]       nonzero = ["Tip x", ...]: rows in which one of these is zero hold no data
//
// Stepwise insertions: a person pushes the needle by a step, and the insertion column takes its new value when the step
// is done. In between nobody knows how deep the base was, so with settled = true only the first row of each new value
// is used: one ACTUATOR_STATE and one TIP_MEASUREMENT each, and one TIP_HEADING where it has columns. A row with depth
// 0 at the entry point begins the log.
// With stops = true the column is the depth commanded, and all rows of one depth are one stop: its reading is their
// median, without the rows in which the needle was moving (csv_stops.hpp), and with the information of a median.
// sigma_mm and heading_sd_rad are of one row. Either way the log says that it has no clock (recording_clock.hpp).
#pragma once

#include <string>
#include <vector>

#include "io/config.hpp"
#include "model/samples.hpp"

namespace bevel::io {

struct SignedColumn {
  std::string name;
  double sign = 1;
};

struct ColumnMap {
  std::string seconds, nanoseconds;  // names; "" if absent
  double rate_hz = 0;                // used if `seconds` is ""
  std::array<SignedColumn, 3> tip;
  std::vector<SignedColumn> origin;  // empty, or three
  std::array<double, 3> sigma_mm{};
  std::vector<SignedColumn> heading;  // empty, or three
  double heading_sd_rad = 0;
  SignedColumn insertion;
  bool settled = false, stops = false;
  bool has_clock() const { return !settled && !stops; }
  std::vector<SignedColumn> rotation;  // empty, or one
  double rotation_scale = 1;
  std::vector<std::string> nonzero;
};
// Throws ConfigError with every fault.
ColumnMap load_column_map(const std::string& path);

struct ImportedRecording {
  std::vector<model::ActuatorState> actuators;
  std::vector<model::TipMeasurement> tips;
  std::vector<model::TipHeading> headings;  // one a tip, or none
  int rows = 0;
  int rows_without_data = 0;
  int rows_unsettled = 0;
  int rows_implausible = 0;           // left out, each with a remark
  std::vector<std::string> left_out;  // a line for each row that is implausible beside its neighbours
  bool has_clock = true;
  double time_shift_s = 0;  // added where the file's clock begins at 0 or below; a log's times are positive

  std::string remarks(const std::string& name) const;  // the last two in lines for stderr; "" if there is nothing
};
// What it returns reads back intact. Throws std::runtime_error naming the file, the line and the column that is
// missing, not a number or out of range, and for motion that no rig makes and that lasts.
ImportedRecording import_csv(const std::string& csv_path, const ColumnMap& map);

// All on their channels, in time order; receipt time is the sample's own. Throws std::runtime_error, and leaves no
// file.
void write_log(const ImportedRecording& recording, const std::string& log_path);

}  // namespace bevel::io
