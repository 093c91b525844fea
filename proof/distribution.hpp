// SPDX-License-Identifier: MIT
#pragma once
// The figures of the published distribution: drawn from in trial.cpp, printed in describe.cpp.
#include <array>

#include "proof/trial.hpp"

namespace bevel::proof {

// Each block of this many trials holds exactly these shares, shuffled.
struct ClassShare {
  TrialClass trial_class;
  int count;
};
inline constexpr int kBlockSize = 25;
inline constexpr std::array<ClassShare, 4> kBlock{
    {{TrialClass::nothing, 8}, {TrialClass::unlisted, 4}, {TrialClass::two, 5}, {TrialClass::one, 8}}};

inline constexpr double kPoorShare = 0.12;         // of trials, with scripts that excite little
inline constexpr double kBeamShare = 0.3;          // of unlisted trials
inline constexpr double kUnlistedAndListed = 0.2;  // of unlisted trials that are not the beam
inline constexpr double kNaturalShare = 0.5;       // sizes as the field reports them; else scaled to a visibility
inline constexpr double kRipple_sigmas = 1.0;      // at most
inline constexpr double kDeparture_sigmas = 3.0;   // at most

}  // namespace bevel::proof
