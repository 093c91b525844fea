// SPDX-License-Identifier: MIT
// A model file put to work: what the software believes of it, and a rig that is it.
#pragma once

#include <cstdint>
#include <vector>

#include <bevel/diagnosis/inference/noise.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/rig/steering/steered_insertion.hpp>

namespace bevel::analysis {

// The estimator and the controller by their defaults, of the model what bevel-estimator and bevel-controller take of
// it: effects that are known before an insertion, and no others (bevel/io/live_effects.hpp).
rig::Believed believed_of(const io::ModelFile& model);

// The model's effects as another insertion of this duration might have them: their angles of single recordings
// anywhere, their instants while the needle goes in. The same for the same seed.
std::vector<model::ActiveEffect> for_one_insertion(const io::ModelFile& model, double duration_s, std::uint64_t seed);

// Cameras that see the tip as those of the recordings, with this noise.
rig::Cameras cameras_of(const diagnosis::RecordedCase& recorded, const inference::Noise& noise);

/// Computes the lateral distance of the tip, mm, where a needle that never rotates reaches a depth (mm along z of {A}),
/// or where it turns back before it.
double farthest_aside_mm(const model::NeedleParameters& needle, double depth_mm);

inline constexpr double kDeepestTarget_mm = 110;      // the controller's workspace with room
inline constexpr double kShareOfFarthestAside = 0.6;  // targets lie within it

}  // namespace bevel::analysis
