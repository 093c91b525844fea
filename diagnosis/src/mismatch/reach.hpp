// SPDX-License-Identifier: MIT
#pragma once
// What these recordings could have shown: of each effect the smallest size, which effects look alike, and the motion
// that would show what stays below.
#include <bevel/diagnosis/mismatch/experiments.hpp>

namespace bevel::diagnosis {

// base: the needle alone.
void find_reach(const NeedleSystem& system, const inference::Search& search, const ChosenModel& base,
                const Experiments& experiments, Findings& findings);

}  // namespace bevel::diagnosis
