// SPDX-License-Identifier: MIT
// What the columns of a CSV recording made elsewhere mean: a TOML file that names them, with their units. No unit is
// guessed. docs/import.md has examples.
//
//   [time]       seconds = "..." and, if the fraction stands apart, nanoseconds = "..."
//                or column = "..." with unit = "s" | "ms" | "us" | "ns", or rate_hz = 30.0 (rows are that far apart);
//                left out with stops = true. offset_s: added to it
//   [tip]        axes = ["Tip z", "-Tip x", "-Tip y"]: the column, with its sign, that each axis of {A} is
//                unit = "um" | "mm" | "cm" | "m" | "in"
//                origin = the same for the entry point (optional), in the tip's unit: its first row; default 0
//                sigma_mm = [x, y, z]: standard deviations; 0 for an axis that was not measured
//                frame = "axes" (default): the axes are those of {A}, or "from-straight-insertion": z and origin of {A}
//                are estimated from each recording (entry_frame.hpp) heading = [x, y, z] (optional): columns, with
//                signs as axes, of the unit vector along the needle's tip heading_sd_rad: its standard deviation to any
//                side; required with heading or quaternion
//   [tip.quaternion] (optional, in place of heading) columns = ["qw", "qx", "qy", "qz"]: of the sensor in the tracker's
//                frame, w first; along = "+z": the sensor's axis that points along the needle to its tip;
//                axes = ["z", "-x", "-y"]: the axis of the tracker's frame that each axis of {A} is
//   [tip.transform] (optional) from the frame of axes, origin, heading and quaternion.axes to {A}: a position p becomes
//                R p + translation_mm, a heading R h. R: rotation = [9 numbers, row by row] or quaternion = [w, x, y,
//                z]
//   [insertion]  column = "-Base y", unit as the tip's; settled = true or stops = true (see below)
//                offset_mm: added to it, after sign and unit
//   [rotation]   column, unit = "rad" | "deg" | "rev", scale (optional factor, a gear's); left out: no rotation
//   [base]       the insertion and rotation stand in a file of their own (bevel-import --base), with
//   [base.time]  its own time, as [time]
//                or, with insertion and rotation in the tip's file, offset_s: added to the time of insertion and
//                rotation
//   [rows]       nonzero = ["Tip x", ...]: rows in which one of these is zero hold no data
//                unseen = ["nan", "-9999"]: cells that mean what an empty one does, that nothing was seen
//
// Stepwise insertions: a person pushes the needle by a step, and the insertion column takes its new value when the step
// is done. In between nobody knows how deep the base was, so with settled = true only the first row of each new value
// is used: one ACTUATOR_STATE and one TIP_MEASUREMENT each, and one TIP_HEADING where it has columns. A row with depth
// 0 at the entry point begins the log. With a [rotation] the needle may be turned between: a row of a new insertion or
// rotation whose tip was not seen is a place that the base went through.
// With stops = true the column is the depth commanded, and all rows of one depth are one stop: its reading is their
// median, without the rows in which the needle was moving (csv_stops.hpp), and with the information of a median.
// sigma_mm and heading_sd_rad are of one row. Either way the log says that it has no clock (recording_clock.hpp).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bevel/io/config.hpp>

namespace bevel::io {

struct SignedColumn {
  std::string name;
  double sign = 1;
};

struct TimeColumn {
  std::string column, nanoseconds;  // names; "" if absent
  double us_per_unit = 1e6;         // of `column`
  double rate_hz = 0;               // used if `column` is ""
  double offset_s = 0;
  const char* unit() const;  // of `column`
};

struct QuaternionColumns {
  std::array<std::string, 4> wxyz;
  std::size_t along = 2;  // axis of the sensor
  double along_sign = 1;
  std::array<std::size_t, 3> axis{};  // of the tracker's frame, for each of {A}
  std::array<double, 3> sign{1, 1, 1};
};

/// Rigid transform from the frame of the tip's columns to {A}: p_A = rotation p + translation_mm.
struct TipTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
};

/// Meaning of the tip's axes: those of {A}, or of a frame from which {A} is estimated.
enum class TipFrame { axes, from_straight_insertion };

struct ColumnMap {
  TimeColumn time;
  std::optional<TimeColumn> base_time;  // if the base has a file of its own
  double base_offset_s = 0;             // added to the time of insertion and rotation in the tip's file
  TipFrame frame = TipFrame::axes;
  std::optional<TipTransform> transform;
  std::array<SignedColumn, 3> tip;
  std::vector<SignedColumn> origin;  // empty, or three
  double mm_per_tip_unit = 1;        // of tip and origin
  std::array<double, 3> sigma_mm{};
  std::vector<SignedColumn> heading;  // empty, or three
  std::optional<QuaternionColumns> quaternion;
  double heading_sd_rad = 0;
  SignedColumn insertion;
  double mm_per_insertion_unit = 1;
  double insertion_offset_mm = 0;
  bool settled = false, stops = false;
  std::vector<SignedColumn> rotation;  // empty, or one
  double rad_per_rotation_unit = 1;    // gear included
  std::vector<std::string> nonzero, unseen;

  bool has_clock() const { return !settled && !stops; }
  /// Whether a tip needs all three axes: a rotation of the frame mixes them.
  bool needs_all_axes() const { return transform.has_value() || frame != TipFrame::axes; }
  bool has_heading() const { return !heading.empty() || quaternion.has_value(); }
};

// Throws ConfigError with every fault.
ColumnMap load_column_map(const std::string& path);

}  // namespace bevel::io
