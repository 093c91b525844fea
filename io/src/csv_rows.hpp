// SPDX-License-Identifier: MIT
// Rows of a CSV file as readings in the project's units and frame, by a column map. What was not seen (an empty cell)
// is not there; it is never 0.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <bevel/io/column_map.hpp>
#include <bevel/io/csv_table.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::io {

// Where a recording begins that has no clock of its own: messages have a positive utime.
inline constexpr std::int64_t kOwnEpoch_us = 1'000'000;

struct CsvRow {
  std::int64_t utime = 0;  // us, of the file's clock: may be 0 or below
  int line = 0;
  std::optional<double> insertion_mm, rotation_rad;
  std::optional<model::TipMeasurement> tip;  // information 0 along an axis that this row does not have
  std::optional<model::TipHeading> heading;
};

struct CsvRows {
  std::vector<CsvRow> rows;  // in order of time
  int read = 0;              // rows of the file
  int without_data = 0;      // of these, left out
  int unsettled = 0;         // of these, left out because the needle was on its way between two steps
};

/// Returns a heading along a vector, whose information is the same to all sides and zero along it.
/// @param along  in {A}, any length above 0
model::TipHeading heading_along(const Eigen::Vector3d& along, double information_per_rad2);

struct CsvParts {
  bool tip = true, base = true;  // which columns to look for
};

// Throws ParseError naming the file, the line and the column that is missing, not a number, out of range, or
// whose time does not grow.
CsvRows read_rows(CsvTable& table, const ColumnMap& map, const TimeColumn& time, CsvParts parts);

// The base's motion at each instant at which one of its axes was read: the other one between its own readings by linear
// interpolation; none where that would be beyond them. status 2 (enabled), rates and seq not set.
struct BaseReading {
  model::ActuatorState axes;
  int line = 0;
};
std::vector<BaseReading> base_motion(const std::vector<CsvRow>& rows, bool has_rotation);

}  // namespace bevel::io
