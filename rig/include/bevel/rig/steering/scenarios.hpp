// SPDX-License-Identifier: MIT
#pragma once
// Needles, tissue and cameras that steering is tried on, and what the software is told of each.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/rig/steering/steered_insertion.hpp>

namespace bevel::rig {

// The needle of a rig, as the rig's part of a system file has it.
struct TrueNeedle {
  model::NeedleParameters bicycle;
  std::optional<model::BeamPlantConfig> beam{};  // in its place
  std::vector<model::ActiveEffect> effects{};    // of the bicycle
  double roll_rad = 0;                           // of the bevel at the start
};

// One target with a rig of its own, and what the software believes.
struct Trial {
  SteeredRig rig;
  TrueNeedle needle;
  Believed believed;
  Eigen::Vector3d target_mm;
};

struct Scenario {
  std::string name;
  std::string what;  // in a sentence
  // The same trial for the same seed.
  std::function<Trial(std::uint64_t seed)> draw;
  bool along_path = false;  // with obstacles or way-points, which the law by arcs alone knows
  bool goes_back = false;   // is drawn back on the way
  bool gated = false;       // arrives where its target turns round
  bool in_table = false;    // of docs/steering.md
  // What the estimate costs is asked for: the same steered by the true tip.
  bool with_floor = false;
  bool by_flips = false;  // the controller by half turns at rest
};

// 5 mm/s, targets 80 to 120 mm deep within 0.6 of the needle's reach, two cameras of 0.2 mm noise where nothing else is
// said.
const std::vector<Scenario>& scenarios();

// A needle, what is believed of it and a target that stands still, seen by two cameras as they should be: what another
// loop, with cameras and axes of its own, can take over from a trial. No effects beside the needle, nothing on the way.
bool is_of_needle_alone(const Scenario& scenario);

}  // namespace bevel::rig
