#include "nodes/camera_watch.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/health.hpp"

namespace bevel::nodes {
namespace {

// No camera measures a moving tip twice to the last bit; three times in a row rules out chance and rounding.
constexpr int kRepeats = 3;
constexpr double kMoved_mm = 0.05;

}  // namespace

void CameraWatch::hear(const tip_measurement_t& m, double insertion_mm, std::int64_t now_ns) {
  Camera& camera = cameras_[m.camera];
  camera.heard_ns = now_ns;
  if (m.status != 0) return;  // it says itself that it sees nothing
  const bool same = std::equal(camera.position_mm.begin(), camera.position_mm.end(), m.position_mm);
  if (!same) {
    std::copy_n(m.position_mm, 3, camera.position_mm.begin());
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
