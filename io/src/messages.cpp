// SPDX-License-Identifier: MIT
#include <bevel/io/messages.hpp>

namespace bevel::io {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

model::TipMeasurement to_sample(const tip_measurement_t& message) {
  model::TipMeasurement sample;
  sample.utime = message.utime;
  sample.seq = message.seq;
  sample.camera = message.camera;
  sample.status = message.status;
  sample.position_mm = Eigen::Map<const Eigen::Vector3d>(message.position_mm);
  sample.information_per_mm2 = Eigen::Map<const RowMajor3>(message.information_per_mm2);
  return sample;
}

model::TipHeading to_sample(const tip_heading_t& message) {
  model::TipHeading sample;
  sample.utime = message.utime;
  sample.seq = message.seq;
  sample.camera = message.camera;
  sample.status = message.status;
  sample.heading = Eigen::Map<const Eigen::Vector3d>(message.heading);
  sample.information_per_rad2 = Eigen::Map<const RowMajor3>(message.information_per_rad2);
  return sample;
}

model::ActuatorState to_sample(const actuator_state_t& message) {
  model::ActuatorState sample;
  sample.utime = message.utime;
  sample.seq = message.seq;
  sample.axis_status = {message.axis_status[0], message.axis_status[1]};
  sample.insertion_mm = message.insertion_mm;
  sample.insertion_rate_mm_s = message.insertion_rate_mm_s;
  sample.rotation_rad = message.rotation_rad;
  sample.rotation_rate_rad_s = message.rotation_rate_rad_s;
  return sample;
}

model::MotionCommand to_sample(const motion_command_t& message) {
  model::MotionCommand sample;
  sample.utime = message.utime;
  sample.seq = message.seq;
  sample.mode = message.mode;
  sample.insertion_rate_mm_s = message.insertion_rate_mm_s;
  sample.rotation_rate_rad_s = message.rotation_rate_rad_s;
  return sample;
}

tip_measurement_t to_message(const model::TipMeasurement& sample) {
  tip_measurement_t message{};
  message.utime = sample.utime;
  message.seq = sample.seq;
  message.camera = sample.camera;
  message.status = sample.status;
  Eigen::Map<Eigen::Vector3d>(message.position_mm) = sample.position_mm;
  Eigen::Map<RowMajor3>(message.information_per_mm2) = sample.information_per_mm2;
  return message;
}

tip_heading_t to_message(const model::TipHeading& sample) {
  tip_heading_t message{};
  message.utime = sample.utime;
  message.seq = sample.seq;
  message.camera = sample.camera;
  message.status = sample.status;
  Eigen::Map<Eigen::Vector3d>(message.heading) = sample.heading;
  Eigen::Map<RowMajor3>(message.information_per_rad2) = sample.information_per_rad2;
  return message;
}

actuator_state_t to_message(const model::ActuatorState& sample) {
  actuator_state_t message{};
  message.utime = sample.utime;
  message.seq = sample.seq;
  message.axis_status[0] = sample.axis_status[0];
  message.axis_status[1] = sample.axis_status[1];
  message.insertion_mm = sample.insertion_mm;
  message.insertion_rate_mm_s = sample.insertion_rate_mm_s;
  message.rotation_rad = sample.rotation_rad;
  message.rotation_rate_rad_s = sample.rotation_rate_rad_s;
  return message;
}

motion_command_t to_message(const model::MotionCommand& sample) {
  motion_command_t message{};
  message.utime = sample.utime;
  message.seq = sample.seq;
  message.mode = sample.mode;
  message.insertion_rate_mm_s = sample.insertion_rate_mm_s;
  message.rotation_rate_rad_s = sample.rotation_rate_rad_s;
  return message;
}

}  // namespace bevel::io
