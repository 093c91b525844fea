// SPDX-License-Identifier: MIT
/// \file
/// Conversion between LCM messages and the plain structures of the model. Fields are copied without checks
/// (bevel/io/checked_decode.hpp checks them).
#pragma once

#include <bevel/actuator_state_t.hpp>
#include <bevel/motion_command_t.hpp>
#include <bevel/tip_heading_t.hpp>
#include <bevel/tip_measurement_t.hpp>

#include <bevel/model/samples.hpp>

namespace bevel::io {

/// Names of LCM channels. Programs of other groups depend on them.
namespace channel {
inline constexpr const char* kTipMeasurement = "TIP_MEASUREMENT";  ///< channel of tip_measurement_t
inline constexpr const char* kTipHeading = "TIP_HEADING";          ///< channel of tip_heading_t
inline constexpr const char* kActuatorState = "ACTUATOR_STATE";    ///< channel of actuator_state_t
inline constexpr const char* kMotionCommand = "MOTION_COMMAND";    ///< channel of motion_command_t
inline constexpr const char* kNeedleState = "NEEDLE_STATE";        ///< channel of needle_state_t: estimates
inline constexpr const char* kNeedleShaft = "NEEDLE_SHAFT";        ///< channel of needle_shaft_t
inline constexpr const char* kNeedleTruth = "NEEDLE_TRUTH";  ///< channel of needle_state_t: true states of a simulation
inline constexpr const char* kSteeringTarget = "STEERING_TARGET";        ///< channel of steering_target_t
inline constexpr const char* kOperatorHeartbeat = "OPERATOR_HEARTBEAT";  ///< channel of operator_heartbeat_t
inline constexpr const char* kProcessStatus = "PROCESS_STATUS";          ///< channel of process_status_t
inline constexpr const char* kConfig = "CONFIG";  ///< channel whose data are the text of the configuration
}  // namespace channel

/// Converts a message to a sample.
/// @param message  any field values; matrices row by row
/// @return sample with the same values
model::TipMeasurement to_sample(const tip_measurement_t& message);
/// Converts a message to a sample.
/// @param message  any field values
/// @return sample with the same values
model::TipHeading to_sample(const tip_heading_t& message);
/// Converts a message to a sample.
/// @param message  any field values
/// @return sample with the same values
model::ActuatorState to_sample(const actuator_state_t& message);
/// Converts a message to a sample.
/// @param message  any field values
/// @return sample with the same values
model::MotionCommand to_sample(const motion_command_t& message);
/// Converts a sample to a message.
/// @param sample  any field values
/// @return message with the same values
tip_measurement_t to_message(const model::TipMeasurement& sample);
/// Converts a sample to a message.
/// @param sample  any field values
/// @return message with the same values
tip_heading_t to_message(const model::TipHeading& sample);
/// Converts a sample to a message.
/// @param sample  any field values
/// @return message with the same values
actuator_state_t to_message(const model::ActuatorState& sample);
/// Converts a sample to a message.
/// @param sample  any field values
/// @return message with the same values
motion_command_t to_message(const model::MotionCommand& sample);

}  // namespace bevel::io
