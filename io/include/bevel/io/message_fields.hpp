// SPDX-License-Identifier: MIT
/// \file
/// All fields of all messages with their limits. The checked decode and its tests use this list.
///
/// visit_fields(message, visitor) calls, in the order of the fields,
/// \code
///   visitor.time(name, value)                    // int64 us since the epoch; positive
///   visitor.count(name, value)                   // int64 counter; not negative
///   visitor.code(name, value, lowest, highest)   // int32; limits of an enumeration by enum_range.hpp
///   visitor.number(name, values, size, largest)  // doubles; finite and |value| <= largest
///   visitor.text(name, value)                    // string
/// \endcode
/// `message` and the values may be const or not. The limits are not physical limits, which belong to the configuration.
/// They reject values that no bench produces and that could overflow in later computations.
#pragma once

#include <bevel/actuator_state_t.hpp>
#include <bevel/motion_command_t.hpp>
#include <bevel/needle_shaft_t.hpp>
#include <bevel/needle_state_t.hpp>
#include <bevel/operator_heartbeat_t.hpp>
#include <bevel/process_status_t.hpp>
#include <bevel/steering_target_t.hpp>
#include <bevel/tip_heading_t.hpp>
#include <bevel/tip_measurement_t.hpp>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <bevel/controller/request.hpp>
#include <bevel/estimator/health.hpp>
#include <bevel/io/enum_range.hpp>
#include <bevel/io/process_state.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::io {

inline constexpr double kLargestLength_mm = 1e5;   ///< limit of positions and lengths, mm
inline constexpr double kLargestRate_mm_s = 1e5;   ///< limit of insertion rates, mm/s
inline constexpr double kLargestAngle_rad = 1e7;   ///< limit of angles, rad; 10 rev/s for a day are 5e6 rad
inline constexpr double kLargestRate_rad_s = 1e5;  ///< limit of rotation rates, rad/s
inline constexpr double kLargestInformation_per_mm2 =
    1e12;  ///< limit of information, 1/mm^2; a standard deviation of 1 nm
inline constexpr double kLargestInformation_per_rad2 =
    1e12;  ///< limit of information, 1/rad^2; a standard deviation of 1 urad
/// Smallest trace of an information matrix that is not zero, 1/mm^2; a standard deviation of 1 m.
inline constexpr double kSmallestInformation_per_mm2 = 1e-6;
/// Smallest trace of an information matrix that is not zero, 1/rad^2; a standard deviation of 10 rad.
inline constexpr double kSmallestInformation_per_rad2 = 1e-2;
inline constexpr double kLargestPlainNumber = 1e12;  ///< limit of other numbers
/// Limit of camera numbers, counts and the status of a measurement. Status 0 means usable. Each other value is a reason
/// of the sender why the measurement is not usable; senders of other makers define other reasons.
inline constexpr std::int32_t kAnyCode = std::numeric_limits<std::int32_t>::max();

/// Requires \p Message to be \p Type, const or not.
template <class Message, class Type>
concept MessageOf = std::is_same_v<std::remove_const_t<Message>, Type>;

/// Visits the fields of a TIP_MEASUREMENT.
/// @param m  message; its values may be changed by the visitor
/// @param v  visitor
template <MessageOf<tip_measurement_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.code("camera", m.camera, 0, kAnyCode);
  v.code("status", m.status, 0, kAnyCode);
  v.number("position_mm", m.position_mm, 3, kLargestLength_mm);
  v.number("information_per_mm2", m.information_per_mm2, 9, kLargestInformation_per_mm2);
}

/// Visits the fields of a TIP_HEADING.
template <MessageOf<tip_heading_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.code("camera", m.camera, 0, kAnyCode);
  v.code("status", m.status, 0, kAnyCode);
  v.number("heading", m.heading, 3, 1.01);
  v.number("information_per_rad2", m.information_per_rad2, 9, kLargestInformation_per_rad2);
}

/// Visits the fields of an ACTUATOR_STATE.
template <MessageOf<actuator_state_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.code("axis_status[0]", m.axis_status[0], 0, last_code<model::AxisStatus>());
  v.code("axis_status[1]", m.axis_status[1], 0, last_code<model::AxisStatus>());
  v.number("insertion_mm", &m.insertion_mm, 1, kLargestLength_mm);
  v.number("insertion_rate_mm_s", &m.insertion_rate_mm_s, 1, kLargestRate_mm_s);
  v.number("rotation_rad", &m.rotation_rad, 1, kLargestAngle_rad);
  v.number("rotation_rate_rad_s", &m.rotation_rate_rad_s, 1, kLargestRate_rad_s);
}

/// Visits the fields of a MOTION_COMMAND.
template <MessageOf<motion_command_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.code("mode", m.mode, 0, last_code<model::MotionMode>());
  v.number("insertion_rate_mm_s", &m.insertion_rate_mm_s, 1, kLargestRate_mm_s);
  v.number("rotation_rate_rad_s", &m.rotation_rate_rad_s, 1, kLargestRate_rad_s);
}

/// Visits the fields of a NEEDLE_STATE or NEEDLE_TRUTH.
template <MessageOf<needle_state_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.count("measurement_utime", m.measurement_utime);  // 0 before the first measurement
  v.number("position_mm", m.position_mm, 3, kLargestLength_mm);
  v.number("orientation_wxyz", m.orientation_wxyz, 4, 1.01);
  v.number("curvature_per_mm", &m.curvature_per_mm, 1, 1.0);
  v.number("lambda1_per_rad", &m.lambda1_per_rad, 1, 1e3);
  v.number("lambda2", &m.lambda2, 1, 1e3);
  v.number("covariance", m.covariance, 81, kLargestPlainNumber);
  v.number("test_ratio", &m.test_ratio, 1, kLargestPlainNumber);
  v.code("rank", m.rank, 0, 3);  // axes of {A}
  v.code("health", m.health, 0, all_flags<estimator::Health>());
  v.code("reset_count", m.reset_count, 0, kAnyCode);
}

/// Visits the fields of a NEEDLE_SHAFT.
template <MessageOf<needle_shaft_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.number("bending_mm", &m.bending_mm, 1, kLargestLength_mm);
  v.number("bending_sd_mm", &m.bending_sd_mm, 1, kLargestLength_mm);
  v.number("guide_mm", &m.guide_mm, 1, kLargestLength_mm);
}

/// Visits the fields of a STEERING_TARGET.
template <MessageOf<steering_target_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.code("request", m.request, 0, last_code<controller::Request>());
  for (auto& session : m.session) v.count("session", session);
  v.number("position_mm", m.position_mm, 3, kLargestLength_mm);
  v.number("tolerance_mm", &m.tolerance_mm, 1, kLargestLength_mm);
}

/// Visits the fields of an OPERATOR_HEARTBEAT.
template <MessageOf<operator_heartbeat_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.count("session", m.session);
}

/// Visits the fields of a PROCESS_STATUS.
template <MessageOf<process_status_t> Message, class Visitor>
void visit_fields(Message& m, Visitor&& v) {
  v.time("utime", m.utime);
  v.count("seq", m.seq);
  v.count("session", m.session);
  v.text("process", m.process);
  v.text("state", m.state);
  v.code("state_code", m.state_code, 0, last_code<ProcessState>());
  v.text("reason", m.reason);
  v.number("loop_period_s", &m.loop_period_s, 1, kLargestPlainNumber);
  v.number("loop_run_max_s", &m.loop_run_max_s, 1, kLargestPlainNumber);
  v.number("loop_late_max_s", &m.loop_late_max_s, 1, kLargestPlainNumber);
  v.count("overruns", m.overruns);
  v.count("received", m.received);
  v.count("rejected", m.rejected);
}

}  // namespace bevel::io
