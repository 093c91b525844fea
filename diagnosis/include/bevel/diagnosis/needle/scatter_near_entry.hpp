// SPDX-License-Identifier: MIT
#pragma once
// Readings scatter more where a needle has hardly entered: a hand guides it, and little tissue holds its tip. Taken as
// equally good, what a few insertions do there by chance passes for physics.
#include <bevel/diagnosis/needle/recorded_case.hpp>

namespace bevel::diagnosis {

// For each channel the likeliest by restricted maximum likelihood, beside a parabola of each recording (of headings, a
// line) and a path that all recordings of a group share, none of them a needle's; where chance would bring as much of a
// gain once in 1000, it is none.
std::vector<ScatterNearEntry> find_scatter_near_entry(const RecordedCase& recorded);

// Channels with theirs, and the claimed standard deviations multiplied by it.
void widen_near_entry(RecordedCase& recorded);

}  // namespace bevel::diagnosis
