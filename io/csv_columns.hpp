// The columns of an exported CSV file, once for writing and for reading. visit_columns(message, visitor) calls, in the
// order of the columns,
//   visitor.whole(name, value)            integers
//   visitor.number(name, value)           doubles
//   visitor.seen(name, value, is_seen)    a double whose cell is empty where is_seen() is false; asked when writing
#pragma once

#include <string>

#include "io/message_fields.hpp"

namespace bevel::io {

// A matrix, row by row: ixx_per_mm2, ixy_per_mm2, ...
template <class Value, class Visitor>
void visit_information(Value (&values)[9], const char* unit, Visitor& v) {
  for (std::size_t i = 0; i < 9; ++i) v.number(std::string("i") + "xyz"[i / 3] + "xyz"[i % 3] + unit, values[i]);
}

template <MessageOf<tip_measurement_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("camera", m.camera);
  v.whole("status", m.status);
  for (std::size_t i = 0; i < 3; ++i)
    v.seen(std::string(1, "xyz"[i]) + "_mm", m.position_mm[i], [&m, i] {
      const auto* W = m.information_per_mm2;
      return W[3 * i] != 0 || W[3 * i + 1] != 0 || W[3 * i + 2] != 0;
    });
  visit_information(m.information_per_mm2, "_per_mm2", v);
}

template <MessageOf<tip_heading_t> Message, class Visitor>
void visit_columns(Message& m, Visitor&& v) {
  v.whole("utime", m.utime);
  v.whole("seq", m.seq);
  v.whole("camera", m.camera);
  v.whole("status", m.status);
  const auto is_seen = [&m] { return m.heading[0] != 0 || m.heading[1] != 0 || m.heading[2] != 0; };
  for (std::size_t i = 0; i < 3; ++i) v.seen(std::string("heading_") + "xyz"[i], m.heading[i], is_seen);
  visit_information(m.information_per_rad2, "_per_rad2", v);
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
  for (std::size_t i = 0; i < 3; ++i) v.number(std::string(1, "xyz"[i]) + "_mm", m.position_mm[i]);
  for (std::size_t i = 0; i < 4; ++i) v.number(std::string("q") + "wxyz"[i], m.orientation_wxyz[i]);
  v.number("curvature_per_mm", m.curvature_per_mm);
  v.number("lambda1_per_rad", m.lambda1_per_rad);
  v.number("lambda2", m.lambda2);
  v.number("test_ratio", m.test_ratio);
  v.whole("rank", m.rank);
  v.whole("health", m.health);
  v.whole("reset_count", m.reset_count);
  for (std::size_t i = 0; i < 81; ++i)
    v.number("p" + std::to_string(i / 9) + "_" + std::to_string(i % 9), m.covariance[i]);
}

namespace exported {
inline constexpr const char* kTips = "tip_measurement.csv";
inline constexpr const char* kHeadings = "tip_heading.csv";
inline constexpr const char* kAxes = "actuator_state.csv";
inline constexpr const char* kCommands = "motion_command.csv";
inline constexpr const char* kEstimates = "needle_state.csv";
inline constexpr const char* kTruths = "needle_truth.csv";
inline constexpr const char* kConfig = "config.toml";
inline constexpr const char* kArrival = "arrival";  // the last column of tips, headings and axes
}  // namespace exported

}  // namespace bevel::io
