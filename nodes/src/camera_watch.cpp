// SPDX-License-Identifier: MIT
#include <bevel/nodes/camera_watch.hpp>

#include <cmath>

#include <bevel/estimator/health.hpp>

namespace bevel::nodes {
namespace {

// No camera measures a moving tip twice to the last bit; three times in a row rules out chance and rounding.
constexpr int kRepeats = 3;
constexpr double kMoved_mm = 0.05;

}  // namespace

void CameraWatch::hear(const tip_measurement_t& m, double insertion_mm, std::int64_t now_ns) {
  hear(m.camera, m.status, std::to_array(m.position_mm), insertion_mm, now_ns);
}

void CameraWatch::hear(const tip_heading_t& m, double insertion_mm, std::int64_t now_ns) {
  hear(m.camera, m.status, std::to_array(m.heading), insertion_mm, now_ns);
}

void CameraWatch::hear(std::int32_t number, std::int32_t status, const Says& says, double insertion_mm,
                       std::int64_t now_ns) {
  Camera& camera = cameras_[number];
  camera.heard_ns = now_ns;
  if (status != 0) return;  // it says itself that it sees nothing
  if (says != camera.says) {
    camera.says = says;
    camera.insertion_mm = insertion_mm;
    camera.repeats = 0;
    camera.frozen = false;
    return;
  }
  ++camera.repeats;
  camera.frozen = camera.repeats >= kRepeats && std::abs(insertion_mm - camera.insertion_mm) > kMoved_mm;
}

std::int32_t CameraWatch::health(std::int64_t now_ns) const {
  std::int32_t health = estimator::kHealthy;
  for (const auto& [number, camera] : cameras_) {
    if (now_ns - camera.heard_ns > silence_ns_) health |= estimator::kCameraSilent;
    if (camera.frozen) health |= estimator::kCameraFrozen;
  }
  return health;
}

}  // namespace bevel::nodes
