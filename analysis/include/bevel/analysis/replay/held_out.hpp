// SPDX-License-Identifier: MIT
#pragma once
// Parameters learned on the other insertions of one tissue, so that a log is predicted by what it has had no part in.
#include <vector>

#include <bevel/analysis/replay/replay.hpp>

namespace bevel::analysis {

// For each replay its own configuration, with k, lambda1 and lambda2 of the prior's mean as the others leave them: the
// prior of that replay's configuration and, on top of it, what each other one's filter has learned of them until its
// last state (inverse covariance at the end less that of its prior; correlations count, directions in which nothing
// was learned do not). The prior's standard deviations of the three are multiplied by `width`: those of the combined
// posterior say how well one needle is known, not by how much the next insertion differs. Parameters with a standard
// deviation of zero stay as they are. At least two replays.
std::vector<estimator::EstimatorConfig> held_out_configs(const std::vector<Replay>& replays, double width);

}  // namespace bevel::analysis
