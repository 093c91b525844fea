#pragma once
// What these recordings could have shown: of each effect the smallest size, which effects look alike, and the motion
// that would show what stays below.
#include "diagnosis/mismatch/experiments.hpp"

namespace bevel::diagnosis {

// A size counts as visible from so many standard deviations of what the base cannot absorb, summed over the recordings.
inline constexpr double kVisibleSigmas = 5.0;

// base: the needle alone.
void find_reach(const NeedleSystem& system, const inference::Search& search, const ChosenModel& base,
                const Experiments& experiments, Findings& findings);

}  // namespace bevel::diagnosis
