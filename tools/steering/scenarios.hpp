#pragma once
// Needles, tissue and cameras that steering is tried on, and what the software is told of each.
#include <cstdint>
#include <string>
#include <vector>

#include "tools/steering/steered_insertion.hpp"

namespace bevel::steering {

// One target with a rig of its own, and what the software believes.
struct Trial {
  SteeredRig rig;
  Believed believed;
  Eigen::Vector3d target_mm;
};

struct Scenario {
  std::string name;
  std::string what;  // in a sentence
  // The same trial for the same seed.
  std::function<Trial(std::uint64_t seed)> draw;
  bool along_path = false;  // with obstacles or way-points, which the law by arcs alone knows
  bool swings = false;      // a stiff shaft, whose tip turning moves
};

// 5 mm/s, targets 80 to 120 mm deep within 0.6 of the needle's reach, two cameras of 0.2 mm noise where nothing else is
// said.
const std::vector<Scenario>& scenarios();

}  // namespace bevel::steering
