// SPDX-License-Identifier: MIT
/// \file
/// Column maps: TOML files that define the meaning and the unit of the columns of a CSV recording. No unit is guessed.
/// docs/import.md has examples.
///
/// \code{.unparsed}
/// [time]       seconds = "..." and, if the fraction has its own column, nanoseconds = "..."
///              or column = "..." with unit = "s" | "ms" | "us" | "ns", or rate_hz = 30.0 (rows at a constant rate);
///              absent with stops = true. offset_s: added to the time
/// [tip]        axes = ["Tip z", "-Tip x", "-Tip y"]: the column, with its sign, of each axis of {A}
///              unit = "um" | "mm" | "cm" | "m" | "in"
///              origin = columns of the entry point (optional), with signs as axes, in the tip's unit; the first row
///              applies; default 0
///              sigma_mm = [x, y, z]: standard deviations; 0 for an axis without measurements
///              frame = "axes" (default): the axes are those of {A}, or "from-straight-insertion": z and origin of {A}
///              are estimated from each recording (entry_frame.hpp)
///              heading = [x, y, z] (optional): columns, with signs as axes, of the unit vector along the needle's tip
///              heading_sd_rad: its standard deviation in each direction; required with heading or quaternion
/// [tip.quaternion] (optional, in place of heading) columns = ["qw", "qx", "qy", "qz"]: orientation of the sensor in
///              the tracker's frame, w first; along = "+z": the sensor's axis that points along the needle to its tip;
///              axes = ["z", "-x", "-y"]: the axis of the tracker's frame for each axis of {A}
/// [tip.transform] (optional) from the frame of axes, origin, heading and quaternion.axes to {A}: a position p becomes
///              R p + translation_mm, a heading h becomes R h. R: rotation = [9 numbers, row by row] or
///              quaternion = [w, x, y, z]
/// [insertion]  column = "-Base y", unit as in [tip]; settled = true or stops = true (see below)
///              offset_mm: added after sign and unit
/// [rotation]   column, unit = "rad" | "deg" | "rev", scale (optional factor, that of a gear); absent: no rotation
/// [base]       insertion and rotation are in a separate file (bevel-import --base) with
/// [base.time]  its own time, as [time]
///              or, with insertion and rotation in the tip's file, offset_s: added to the time of insertion and
///              rotation
/// [rows]       nonzero = ["Tip x", ...]: rows in which one of these is zero contain no data
///              unseen = ["nan", "-9999"]: cells that mean the same as an empty cell: no measurement
/// \endcode
///
/// Stepwise insertions: a person pushes the needle by a step, and the insertion column takes its new value when the
/// step is complete. The depth between two values is unknown. With settled = true only the first row of each new value
/// is used: one ACTUATOR_STATE, one TIP_MEASUREMENT, and one TIP_HEADING if it has columns. A row with depth 0 at the
/// entry point begins the log. With a [rotation] the needle may be rotated between steps: a row of a new insertion or
/// rotation without a tip measurement is a position that the actuator passed.
///
/// With stops = true the column is the commanded depth, and all consecutive rows of one depth are one stop. Its
/// measurement is the median of the rows in which the needle does not move, with the information of a median. sigma_mm
/// and heading_sd_rad are those of one row.
///
/// In both cases the log states that it has no clock (recording_clock.hpp).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/config.hpp>

namespace bevel::io {

/// Column with a sign.
struct SignedColumn {
  std::string name;  ///< name in the header of the CSV file
  double sign = 1;   ///< 1 or -1
};

/// Columns and unit of the time of a file.
struct TimeColumn {
  std::string column,        ///< name of the time column; "" if the rows have a constant rate or no time
      nanoseconds;           ///< name of the column with the fraction of a second in ns; "" if absent
  double us_per_unit = 1e6;  ///< us per unit of \ref column
  double rate_hz = 0;        ///< rate of the rows, Hz, used if \ref column is ""
  double offset_s = 0;       ///< added to the time, s
  /// Returns the unit of the column: "s", "ms", "us" or "ns".
  /// @return static text
  const char* unit() const;
};

/// Columns of a quaternion from which the heading is computed.
struct QuaternionColumns {
  std::array<std::string, 4> wxyz;      ///< names of the columns; sensor to tracker frame, w first
  std::size_t along = 2;                ///< axis of the sensor along the needle to its tip: 0, 1 or 2
  double along_sign = 1;                ///< 1 or -1: direction of this axis
  std::array<std::size_t, 3> axis{};    ///< axis of the tracker's frame for each axis of {A}: 0, 1 or 2
  std::array<double, 3> sign{1, 1, 1};  ///< 1 or -1 for each of these axes
};

/// Rigid transform from the frame of the tip's columns to {A}: p_A = rotation p_tip + translation_mm.
struct TipTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();    ///< 3x3 rotation matrix
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();  ///< origin of the columns' frame in {A}, mm
};

/// Frame of the tip's axes.
enum class TipFrame {
  axes,                    ///< the axes are those of {A}
  from_straight_insertion  ///< {A} is estimated from the insertion (entry_frame.hpp)
};

/// Contents of a column map.
struct ColumnMap {
  TimeColumn time;                        ///< time of the tip's file
  std::optional<TimeColumn> base_time;    ///< time of the file of insertion and rotation, if they have a separate file
  double base_offset_s = 0;               ///< added to the time of insertion and rotation in the tip's file, s
  TipFrame frame = TipFrame::axes;        ///< frame of the tip's axes
  std::optional<TipTransform> transform;  ///< transform of positions and headings to {A}
  std::array<SignedColumn, 3> tip;        ///< column of each axis of the tip position
  std::vector<SignedColumn> origin;       ///< columns of the entry point: none or three
  double mm_per_tip_unit = 1;             ///< mm per unit of tip and origin
  std::array<double, 3> sigma_mm{};       ///< standard deviation of each axis in mm; 0: not measured
  std::vector<SignedColumn> heading;      ///< columns of the heading: none or three
  std::optional<QuaternionColumns> quaternion;  ///< columns of the sensor's orientation, in place of the heading
  double heading_sd_rad = 0;                    ///< standard deviation of the heading in each direction, rad
  SignedColumn insertion;                       ///< column of the insertion
  double mm_per_insertion_unit = 1;             ///< mm per unit of the insertion
  double insertion_offset_mm = 0;               ///< added to the insertion after sign and unit, mm
  bool settled = false,                         ///< stepwise insertion: only the first row of each depth is used
      stops = false;                            ///< stepwise insertion: all rows of a depth are one stop
  std::vector<SignedColumn> rotation;           ///< column of the rotation: none or one
  double rad_per_rotation_unit = 1;             ///< rad per unit of the rotation, including the gear
  std::vector<std::string> nonzero,             ///< columns whose zero means that the row contains no data
      unseen;                                   ///< cell texts that mean the same as an empty cell

  /// Returns whether the times of the rows are meaningful: false for stepwise insertions.
  /// @return true if the recording has time stamps
  bool has_clock() const { return !settled && !stops; }
  /// Returns whether a tip needs all three axes: a rotation of the frame mixes them.
  /// @return true with a transform or an estimated frame
  bool needs_all_axes() const { return transform.has_value() || frame != TipFrame::axes; }
  /// Returns whether the map has columns for the heading or for a quaternion.
  /// @return true if headings are imported
  bool has_heading() const { return !heading.empty() || quaternion.has_value(); }
};

/// Reads a column map.
/// @param path  TOML file
/// @return the column map
/// @throws ConfigError with all faults of the file
ColumnMap load_column_map(const std::string& path);

}  // namespace bevel::io
