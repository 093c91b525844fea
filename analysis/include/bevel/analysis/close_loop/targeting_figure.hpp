// SPDX-License-Identifier: MIT
// Many steered insertions: how far from the target the needle comes to rest, with one model in the software or another.
#pragma once

#include <string>
#include <vector>

#include <bevel/analysis/close_loop/models.hpp>
#include <bevel/cli/progress_line.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/rig/steering/steered_insertion.hpp>

namespace bevel::analysis {

struct WithInterval {
  double value = 0, low = 0, high = 0;  // 95 %, bootstrap over the insertions
};

struct TargetingFigure {
  std::vector<double> miss_mm;  // one per insertion, in the same order for each model
  WithInterval mean_mm, largest_mm;
  int stopped = 0;             // came to rest before the target, or never left; counted where they stood
  std::string why;             // the commonest reason
  double turns_per_100mm = 0;  // of the base, on average
};

// All with the same targets and the same noise.
struct TargetingFigures {
  std::array<TargetingFigure, kStages> live;       // the filter as it runs live
  std::array<TargetingFigure, kStages> forgiving;  // its process noise widened: what someone would do who has no better
                                                   // model and whose filter rejects what it sees
  TargetingFigure axes_not_undone;                 // live and augmented, but the controller is not told
  bool axes_matter = false;                        // whether there is anything to undo
  // Falls of the mean miss, of the same insertions: refitted to augmented, and by undoing what lies between the axes
  // and the tip.
  WithInterval gain_mm, gain_forgiving_mm, gain_by_axes_mm;
  std::vector<Eigen::Vector3d> targets_mm;
  std::vector<std::uint64_t> seeds;
};
inline constexpr double kForgiveness = 10;

// Targets that the rig reaches, no deeper than it was recorded, all around. Throws IoError where the needle
// bends too little for one.
std::vector<Eigen::Vector3d> choose_targets(const model::NeedleParameters& needle, double deepest_mm);

struct TargetingOptions {
  int seeds = 6;
  int bootstrap_draws = 4000;
  int threads = 2;
  cli::ProgressLine* progress = nullptr;  // counts the simulated insertions
};

// The rig is the augmented model, its unknowns of single recordings (a phase, an instant) drawn anew for each
// insertion; nobody tells the software these.
TargetingFigures steer_all(const Models& models, const diagnosis::RecordedCase& recorded, const inference::Noise& noise,
                           const TargetingOptions& options);

}  // namespace bevel::analysis
