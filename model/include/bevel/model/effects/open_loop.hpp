// SPDX-License-Identifier: MIT
#pragma once
// The tip along a recording from the base's motion alone, as the cameras would report it, with sensitivities.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::model {

// The base's motion cut into legs: at every moment at which a reading is wanted, where a rate jumps, and so often that
// no leg is longer than 1 mm or 0.2 rad. Times count from the first actuator sample.
struct Motion {
  std::vector<BaseMotion> nodes;  // the first is the entry
  std::vector<std::size_t> at;    // node of each reading
  std::int64_t start_utime = 0;
};

// Both in order of time. Positions between actuator samples are interpolated linearly; outside their span the base
// stands. Throws ArgumentError for fewer than two actuator samples, or times that run backwards.
Motion make_motion(std::span<const ActuatorState> actuators, std::span<const std::int64_t> reading_utimes);

struct OpenLoop {
  std::vector<Eigen::Vector3d> position_mm;  // one per reading
  Eigen::MatrixXd jacobian;                  // 3 rows per reading, by the needle's columns
  // Without columns: variance of each by what effects do not know of themselves, along the axes of {A}.
  std::vector<std::array<double, 3>> blur_mm2;
  // Unit vectors; where headings are asked for, one per reading.
  std::vector<Eigen::Vector3d> heading;
  Eigen::MatrixXd heading_jacobian;

  // Room for predict(), kept from one call to the next: vectors and their derivatives, of the nodes and, where the tip
  // jumps between nodes, of late readings.
  struct Track {
    std::vector<Eigen::Vector3d> value;
    Eigen::MatrixXd jacobian;  // 3 rows each
  };
  Track node_position_mm, node_heading, late_position_mm, late_heading;
  std::vector<std::array<double, 3>> node_blur_mm2;
};

// False where the tip leaves the domain of the slip law. A late camera sees the path between two nodes as straight, but
// where effects are sudden, which put a jump there; sensitivities by the latency are means over the leg in any case:
// the path's own would be none where a tip is held, and without end where it jumps.
bool predict(const AugmentedNeedle& needle, const Motion& motion, OpenLoop& out, bool headings = false);

}  // namespace bevel::model
