// SPDX-License-Identifier: MIT
#pragma once
// One trial as drawn from the published distribution: what is concealed, what the camera saw, what the lab believes.
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <bevel/model/beam/beam_plant.hpp>
#include "proof/visibility.hpp"

namespace bevel::proof {

enum class TrialClass { nothing, unlisted, two, one };
const char* name_of(TrialClass trial_class);

// An effect is visible from here on; below, "nothing missing" is the right answer.
inline constexpr double kVisible_sigmas = 5.0;

struct TruthEntry {
  ConcealedEffect effect;
  double visible_sigmas = 0;  // of this effect, the others given
  // Of a visible listed effect: the parameters by which the plain forms of all such come closest to this plant.
  std::map<std::string, double> nearest = {};
};

struct Truth {
  int trial = 0;
  TrialClass trial_class = TrialClass::nothing;
  bool beam = false;          // the beam plant: tip_swing, and "unknown" where the tissue relaxes
  bool rich = true;           // scripts that excite everything
  std::vector<bool> changed;  // of two groups: the recordings in which something is concealed; empty: one group
  std::vector<TruthEntry> entries;
  double visible_sigmas = 0;    // of all together
  std::vector<Rival> rivals;    // listed effects that imitate the one unlisted, below kVisible_sigmas of difference
  double departure = 1;         // of the forms, see HiddenPhysics
  double departure_sigmas = 0;  // what of it could be seen
  double ripple_sigmas = 0;     // what of the drives' periodic errors could be seen
  VariationSpread spread;       // between insertions; zeros: none
  std::vector<InsertionVariation> variation;  // per recording
  BaseNeedle needle;                          // for the beam: the closest bicycle
  BaseNeedle believed;                        // in the model file
  CameraNoise noise;
  DriveRipple ripple;
  std::vector<std::string> script_kinds;
  std::optional<model::BeamPlantConfig> beam_config;

  // The right answer: ids of the visible effects, "unknown" among them where one is on no list; sorted, no repeats.
  std::vector<std::string> expected() const;
  std::vector<std::string> concealed() const;  // visible or not
};

struct TrialRecording {
  AxisMotion motion;
  Script script;
  Frames frames;
  Eigen::Matrix3Xd reported_mm;  // with noise
};

struct Trial {
  Truth truth;
  std::vector<TrialRecording> recordings;
};

// What trials are drawn from.
struct Population {
  double varied = 0;        // share of trials whose insertions differ
  int edition = kEditions;  // of the distribution; the first, with none varied: the campaigns up to the ninth
  bool nulls = false;       // nothing is concealed in any of them: what a tool is calibrated on
  bool two_groups = false;  // recordings before and after: what is concealed, is so in those after
};

// The same trial for the same seed and number, on any machine.
Trial draw_trial(std::uint64_t seed, int number, const Population& population = {});
// The same, before anything is concealed and seen: needle, noise, motions, frames, what insertions have of their own. A
// fraction of the time.
Trial draw_recordings(std::uint64_t seed, int number, const Population& population = {});
TrialClass class_of(std::uint64_t seed, int number);

// The distribution in words and tables (Markdown).
std::string describe_distribution();

}  // namespace bevel::proof
