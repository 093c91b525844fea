// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Estimates the excess variance of measurements near the entry, where a hand guides the needle and little tissue
/// supports its tip. Without this term, random deviations of a few insertions near the entry are confounded with
/// physics.
#include <bevel/diagnosis/needle/recorded_case.hpp>

namespace bevel::diagnosis {

/// Estimates the excess of each channel by restricted maximum likelihood. The mean is a parabola per recording (for
/// headings a line) plus a path that all recordings of a group share; no needle model is used. There is no excess
/// unless the gain in likelihood is one that chance gives in fewer than 1 of 1000 cases.
/// @param recorded recordings
/// @return one entry per channel
std::vector<ScatterNearEntry> find_scatter_near_entry(const RecordedCase& recorded);

/// Sets Channel::scatter to find_scatter_near_entry() and multiplies the claimed standard deviations by it.
/// @param recorded recordings, changed in place
void widen_near_entry(RecordedCase& recorded);

}  // namespace bevel::diagnosis
