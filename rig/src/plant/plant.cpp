// SPDX-License-Identifier: MIT
#include <bevel/rig/plant/plant.hpp>

namespace bevel::rig {

std::vector<Eigen::Vector3d> shaft_seen_along_x(const Plant& plant) {
  std::vector<Eigen::Vector3d> seen = plant.shaft_mm();
  model::TipReading reading{{}, model::PointColumns(3, 0)};
  for (Eigen::Vector3d& p : seen) {
    reading.position_mm = p;
    plant.model().through_cameras(reading);
    p = reading.position_mm;
  }
  return seen;
}

}  // namespace bevel::rig
