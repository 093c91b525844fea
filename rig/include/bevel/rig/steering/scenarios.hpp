// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Needles, tissue and cameras for trials of steering, and the model and settings of the software in each.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <bevel/rig/steering/steered_insertion.hpp>

namespace bevel::rig {

/// The needle of the plant, as in the rig's part of a system file.
struct TrueNeedle {
  model::NeedleParameters bicycle;               ///< parameters of the bicycle model
  std::optional<model::BeamPlantConfig> beam{};  ///< beam that replaces the bicycle; empty: none
  std::vector<model::ActiveEffect> effects{};    ///< effects added to the bicycle
  double roll_rad = 0;                           ///< roll of the bevel at the start, rad
};

/// One target with its simulated rig, and the model and settings of the software.
struct Trial {
  SteeredRig rig;             ///< simulated rig
  TrueNeedle needle;          ///< needle of the rig
  Believed believed;          ///< model and settings of the software under test
  Eigen::Vector3d target_mm;  ///< target in {A}, mm
};

/// A family of trials.
struct Scenario {
  std::string name;  ///< name on the command line
  std::string what;  ///< description in one sentence
  /// Draws a trial; a seed determines it.
  std::function<Trial(std::uint64_t seed)> draw;
  bool along_path = false;  ///< with obstacles or way-points, which only the law by arcs supports
  bool goes_back = false;   ///< the needle is retracted during the insertion
  bool gated = false;       ///< the arrival is timed to where the target reverses its motion
  bool in_table = false;    ///< part of the table in docs/steering.md
  /// The cost of the estimate is measured: the trial is also steered by the true tip.
  bool with_floor = false;
  bool by_flips = false;  ///< the controller steers by half turns while stopped
};

/// Returns all scenarios: 5 mm/s, targets 80 to 120 mm deep within 0.6 of the needle's reach, two cameras with 0.2 mm
/// noise unless the scenario states otherwise.
/// @return static list
const std::vector<Scenario>& scenarios();

/// Returns whether another loop that simulates cameras and axes can run a scenario's trials: only a needle, its model
/// and a stationary target, observed by two correct cameras. No effects in addition to the needle, no obstacles or
/// way-points.
/// @param scenario scenario
/// @return true if another loop can run it
bool is_of_needle_alone(const Scenario& scenario);

}  // namespace bevel::rig
