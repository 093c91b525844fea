// SPDX-License-Identifier: MIT
// LCM messages to and from the plain structures of the core. Field by field; no checks (bevel/io/checked_decode.hpp has
// them).
#pragma once

#include <bevel/actuator_state_t.hpp>
#include <bevel/motion_command_t.hpp>
#include <bevel/tip_heading_t.hpp>
#include <bevel/tip_measurement_t.hpp>

#include <bevel/model/samples.hpp>

namespace bevel::io {

// Channel names are contracts with programs made elsewhere.
namespace channel {
inline constexpr const char* kTipMeasurement = "TIP_MEASUREMENT";
inline constexpr const char* kTipHeading = "TIP_HEADING";
inline constexpr const char* kActuatorState = "ACTUATOR_STATE";
inline constexpr const char* kMotionCommand = "MOTION_COMMAND";
inline constexpr const char* kNeedleState = "NEEDLE_STATE";
inline constexpr const char* kNeedleShaft = "NEEDLE_SHAFT";
inline constexpr const char* kNeedleTruth = "NEEDLE_TRUTH";
inline constexpr const char* kSteeringTarget = "STEERING_TARGET";
inline constexpr const char* kOperatorHeartbeat = "OPERATOR_HEARTBEAT";
inline constexpr const char* kProcessStatus = "PROCESS_STATUS";
inline constexpr const char* kConfig = "CONFIG";  // the bytes are the configuration's text
}  // namespace channel

model::TipMeasurement to_sample(const tip_measurement_t& message);
model::TipHeading to_sample(const tip_heading_t& message);
model::ActuatorState to_sample(const actuator_state_t& message);
model::MotionCommand to_sample(const motion_command_t& message);
tip_measurement_t to_message(const model::TipMeasurement& sample);
tip_heading_t to_message(const model::TipHeading& sample);
actuator_state_t to_message(const model::ActuatorState& sample);
motion_command_t to_message(const model::MotionCommand& sample);

}  // namespace bevel::io
