// One steered insertion in simulated time: a plant with its cameras and axes, and the estimator and the controller as
// they run live, with a model of their own. No clock, no messages; the same seed gives the same run.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/supervisor.hpp"
#include "diagnosis/inference/noise.hpp"
#include "diagnosis/needle/recorded_case.hpp"
#include "estimator/config.hpp"
#include "rig/plant/plant.hpp"

namespace bevel::close_loop {

// Of the rig: what the software is not told.
struct SteeredRig {
  model::NeedleParameters needle;
  std::vector<model::ActiveEffect> effects;
  std::vector<diagnosis::Channel> channels;  // what its cameras see
  inference::Noise noise;                    // of those; outliers, of which only the share is known, are left out
  double transport_s = 0.05;                 // from the picture to its measurement
  model::OwnValues own{};                    // of this insertion
};

// What the software believes.
struct Believed {
  model::NeedleParameters needle;
  std::vector<model::ActiveEffect> effects;
  double forgiveness = 1;             // times the filter's process noise as it runs live
  bool controller_knows_axes = true;  // effects of the axes are undone by the controller too, not only followed
  model::Variation variation{};       // by how much insertions differ
};

struct Insertion {
  double miss_mm = 0;  // true tip to target where it came to rest
  bool arrived = false;
  controller::Reason reason = controller::Reason::none;  // why not
  double estimate_error_mm = 0;                          // estimate to true tip, at the end
  double turned_rad = 0;                                 // of the base, both ways together
};

Insertion steer(const SteeredRig& rig, const Believed& believed, const Eigen::Vector3d& target_mm, std::uint64_t seed);

}  // namespace bevel::close_loop
