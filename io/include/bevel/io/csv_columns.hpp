// SPDX-License-Identifier: MIT
/// \file
/// Columns of exported CSV files, defined once for writing and for reading. The fields of MCAP messages have the same
/// names.
///
/// visit_columns(message, visitor) calls, in the order of the columns,
/// \code
///   visitor.whole(name, value)            // integers
///   visitor.number(name, value)           // doubles
///   visitor.seen(name, value, is_seen)    // a double whose cell is empty if is_seen() is false; called when writing
/// \endcode
/// Names are static text: to allocate a name for each cell would take longer than to format the digits.
#pragma once

#include <array>
#include <cstddef>

#include <bevel/io/message_fields.hpp>

namespace bevel::io {

/// Names of columns and files of an export.
namespace exported {
/// Columns of the information matrix of a position, row by row, 1/mm^2.
inline constexpr std::array<const char*, 9> kPerSquareMillimetre{"ixx_per_mm2", "ixy_per_mm2", "ixz_per_mm2",
                                                                 "iyx_per_mm2", "iyy_per_mm2", "iyz_per_mm2",
                                                                 "izx_per_mm2", "izy_per_mm2", "izz_per_mm2"};
/// Columns of the information matrix of a heading, row by row, 1/rad^2.
inline constexpr std::array<const char*, 9> kPerSquareRadian{"ixx_per_rad2", "ixy_per_rad2", "ixz_per_rad2",
                                                             "iyx_per_rad2", "iyy_per_rad2", "iyz_per_rad2",
                                                             "izx_per_rad2", "izy_per_rad2", "izz_per_rad2"};
/// Columns of the covariance of the needle state, 9x9, row by row: p0_0 to p8_8.
inline constexpr auto kCovariance = [] {
  std::array<std::array<char, 5>, 81> names{};
  for (std::size_t i = 0; i < names.size(); ++i)
    names[i] = {'p', static_cast<char>('0' + i / 9), '_', static_cast<char>('0' + i % 9), 0};
  return names;
}();
inline constexpr std::array<const char*, 3> kPosition{"x_mm", "y_mm", "z_mm"};  ///< columns of a position in {A}, mm
inline constexpr std::array<const char*, 3> kHeading{"heading_x", "heading_y",
                                                     "heading_z"};  ///< columns of a heading in {A}
inline constexpr std::array<const char*, 4> kOrientation{"qw", "qx", "qy",
                                                         "qz"};  ///< columns of an orientation, w first
}  // namespace exported

/// Visits the columns of a TIP_MEASUREMENT. A position is not seen along an axis whose row of the information matrix is
/// zero.
/// @param m  message; its values may be changed by the visitor
/// @param v  visitor
template <MessageOf<tip_measurement_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("camera", m.camera);
  v.whole("status", m.status);
  for (std::size_t i = 0; i < 3; ++i)
    v.seen(exported::kPosition[i], m.position_mm[i], [&m, i] {
      const auto* W = m.information_per_mm2;
      return W[3 * i] != 0 || W[3 * i + 1] != 0 || W[3 * i + 2] != 0;
    });
  for (std::size_t i = 0; i < 9; ++i) v.number(exported::kPerSquareMillimetre[i], m.information_per_mm2[i]);
}

/// Visits the columns of a TIP_HEADING; a heading of length 0 is not seen.
template <MessageOf<tip_heading_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("camera", m.camera);
  v.whole("status", m.status);
  const auto is_seen = [&m] { return m.heading[0] != 0 || m.heading[1] != 0 || m.heading[2] != 0; };
  for (std::size_t i = 0; i < 3; ++i) v.seen(exported::kHeading[i], m.heading[i], is_seen);
  for (std::size_t i = 0; i < 9; ++i) v.number(exported::kPerSquareRadian[i], m.information_per_rad2[i]);
}

/// Visits the columns of an ACTUATOR_STATE.
template <MessageOf<actuator_state_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("insertion_status", m.axis_status[0]);
  v.whole("rotation_status", m.axis_status[1]);
  v.number("insertion_mm", m.insertion_mm);
  v.number("insertion_rate_mm_s", m.insertion_rate_mm_s);
  v.number("rotation_rad", m.rotation_rad);
  v.number("rotation_rate_rad_s", m.rotation_rate_rad_s);
}

/// Visits the columns of a MOTION_COMMAND.
template <MessageOf<motion_command_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("mode", m.mode);
  v.number("insertion_rate_mm_s", m.insertion_rate_mm_s);
  v.number("rotation_rate_rad_s", m.rotation_rate_rad_s);
}

/// Visits the columns of a NEEDLE_STATE or NEEDLE_TRUTH.
template <MessageOf<needle_state_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("measurement_utime", m.measurement_utime);
  for (std::size_t i = 0; i < 3; ++i) v.number(exported::kPosition[i], m.position_mm[i]);
  for (std::size_t i = 0; i < 4; ++i) v.number(exported::kOrientation[i], m.orientation_wxyz[i]);
  v.number("curvature_per_mm", m.curvature_per_mm);
  v.number("lambda1_per_rad", m.lambda1_per_rad);
  v.number("lambda2", m.lambda2);
  v.number("test_ratio", m.test_ratio);
  v.whole("rank", m.rank);
  v.whole("health", m.health);
  v.whole("reset_count", m.reset_count);
  for (std::size_t i = 0; i < 81; ++i) v.number(exported::kCovariance[i].data(), m.covariance[i]);
}

namespace exported {
inline constexpr const char* kTips = "tip_measurement.csv";     ///< tip positions
inline constexpr const char* kHeadings = "tip_heading.csv";     ///< headings
inline constexpr const char* kAxes = "actuator_state.csv";      ///< actuator states
inline constexpr const char* kCommands = "motion_command.csv";  ///< motion commands
inline constexpr const char* kEstimates = "needle_state.csv";   ///< estimates
inline constexpr const char* kTruths = "needle_truth.csv";      ///< true states of a simulation
inline constexpr const char* kConfig = "config.toml";           ///< text of CONFIG
inline constexpr const char* kRows = "rows.toml";               ///< number of rows of each table; written last
inline constexpr const char* kArrival = "arrival";              ///< last column of tips, headings and actuator states
}  // namespace exported

}  // namespace bevel::io
