// SPDX-License-Identifier: MIT
#pragma once
// When the missing physics begins to act in one recording.
#include <optional>

#include <bevel/diagnosis/mismatch/decision.hpp>

namespace bevel::diagnosis {

/// The physics begins to act in [from_s, to_s], time since the recording's start.
struct Onset {
  double from_s = 0;
  double to_s = 0;
};

/// Computes when the physics of a model begins to act in a recording, from the innovations of the nominal model: for
/// each time t0, the nominal model predicts the measurements after t0 from the state at t0 (position, and direction of
/// the path), and the model with the physics predicts them up to there.
///
/// from_s is the last t0 up to which the physics moved the measurements by less than a tenth of a standard deviation of
/// the noise; to_s is the first t0 that is rejected as its onset with 95 % (chi2 with one degree of freedom). The
/// nominal model has the parameters of the model with the physics, so it does not absorb a part of it.
///
/// @param model the model with the physics
/// @param recording index of the recording
/// @return null if the onset is not determined: no time is rejected, or the interval is longer than half of the
/// recording
std::optional<Onset> onset_of(const NeedleSystem& system, const ChosenModel& model, std::size_t recording);

}  // namespace bevel::diagnosis
