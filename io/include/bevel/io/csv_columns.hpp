// SPDX-License-Identifier: MIT
// The columns of an exported CSV file, once for writing and for reading. visit_columns(message, visitor) calls, in the
// order of the columns,
//   visitor.whole(name, value)            integers
//   visitor.number(name, value)           doubles
//   visitor.seen(name, value, is_seen)    a double whose cell is empty where is_seen() is false; asked when writing
// Names are static text: making one of each cell would take longer than its digits. The fields of MCAP messages have
// the same names.
#pragma once

#include <array>
#include <cstddef>

#include <bevel/io/message_fields.hpp>

namespace bevel::io {

namespace exported {
// Matrices, row by row.
inline constexpr std::array<const char*, 9> kPerSquareMillimetre{"ixx_per_mm2", "ixy_per_mm2", "ixz_per_mm2",
                                                                 "iyx_per_mm2", "iyy_per_mm2", "iyz_per_mm2",
                                                                 "izx_per_mm2", "izy_per_mm2", "izz_per_mm2"};
inline constexpr std::array<const char*, 9> kPerSquareRadian{"ixx_per_rad2", "ixy_per_rad2", "ixz_per_rad2",
                                                             "iyx_per_rad2", "iyy_per_rad2", "iyz_per_rad2",
                                                             "izx_per_rad2", "izy_per_rad2", "izz_per_rad2"};
inline constexpr auto kCovariance = [] {
  std::array<std::array<char, 5>, 81> names{};
  for (std::size_t i = 0; i < names.size(); ++i)
    names[i] = {'p', static_cast<char>('0' + i / 9), '_', static_cast<char>('0' + i % 9), 0};
  return names;
}();
inline constexpr std::array<const char*, 3> kPosition{"x_mm", "y_mm", "z_mm"};
inline constexpr std::array<const char*, 3> kHeading{"heading_x", "heading_y", "heading_z"};
inline constexpr std::array<const char*, 4> kOrientation{"qw", "qx", "qy", "qz"};
}  // namespace exported

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

template <MessageOf<motion_command_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("mode", m.mode);
  v.number("insertion_rate_mm_s", m.insertion_rate_mm_s);
  v.number("rotation_rate_rad_s", m.rotation_rate_rad_s);
}

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
inline constexpr const char* kTips = "tip_measurement.csv";
inline constexpr const char* kHeadings = "tip_heading.csv";
inline constexpr const char* kAxes = "actuator_state.csv";
inline constexpr const char* kCommands = "motion_command.csv";
inline constexpr const char* kEstimates = "needle_state.csv";
inline constexpr const char* kTruths = "needle_truth.csv";
inline constexpr const char* kConfig = "config.toml";
inline constexpr const char* kRows = "rows.toml";   // number of rows of each table; written last
inline constexpr const char* kArrival = "arrival";  // the last column of tips, headings and axes
}  // namespace exported

}  // namespace bevel::io
