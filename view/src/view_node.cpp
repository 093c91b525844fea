// SPDX-License-Identifier: MIT
#include <bevel/view/view_node.hpp>

#include <utility>

#include <bevel/io/camera_picture.hpp>

namespace bevel::view {

ViewNode::ViewNode(lcm::LCM& lcm, int socket, std::vector<std::string> hosts)
    : lcm_(lcm),
      port_(lcm),
      server_(
          socket,
          [this] {
            const std::lock_guard lock(mutex_);
            return picture_.history();
          },
          [this](std::int32_t camera, std::int64_t count) {
            const std::lock_guard lock(mutex_);
            return picture_.picture(camera, count);
          },
          std::move(hosts)) {
  watch<tip_measurement_t>(io::channel::kTipMeasurement);
  watch<actuator_state_t>(io::channel::kActuatorState);
  watch<motion_command_t>(io::channel::kMotionCommand);
  watch<needle_state_t>(io::channel::kNeedleState);
  watch<steering_target_t>(io::channel::kSteeringTarget);
  watch<process_status_t>(io::channel::kProcessStatus);
  watch<camera_picture_t>(io::channel::kCameraPicture);
  port_.subscribe<needle_state_t>(io::channel::kNeedleTruth, [this](const needle_state_t& message) {
    const std::lock_guard lock(mutex_);
    picture_.on_truth(message, moment());
  });
  config_ = lcm_.subscribe(io::channel::kConfig, &ViewNode::on_config, this);
}

ViewNode::~ViewNode() {
  if (config_ != nullptr) lcm_.unsubscribe(config_);
}

// The text itself is not shown.
void ViewNode::on_config(const lcm::ReceiveBuffer*, const std::string&) {
  const std::lock_guard lock(mutex_);
  picture_.on_config();
}

template <class Message>
void ViewNode::watch(const char* channel) {
  port_.subscribe<Message>(channel, [this](const Message& message) {
    const std::lock_guard lock(mutex_);
    picture_.on(message, moment());
  });
}

void ViewNode::step(const nodes::Now& now) {
  port_.rethrow();
  std::string snapshot;
  {
    const std::lock_guard lock(mutex_);
    snapshot = picture_.snapshot({now.ns, now.utime});
  }
  server_.publish(std::move(snapshot));
}

}  // namespace bevel::view
