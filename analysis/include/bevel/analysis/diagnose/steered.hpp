// SPDX-License-Identifier: MIT
// The miss at a target by closed loop: what the model file as it stands costs, and what the model that was found
// leaves.
#pragma once

#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

struct SteeringOptions {
  int targets = 8;
  int threads = 2;
};

// Draws targets in the last tenth of the recordings' depth (of at most kDeepestTarget_mm) and within the
// reach of both models' needles, and steers to each twice (tools/steering), on a rig that is `found` with the
// recordings' cameras and noise: with `in_use` in estimator and controller, and with `found`. Fills findings.steered;
// or findings.not_steered, where what was found moves the tip but cannot be steered by. Neither where nothing was found
// that moves the tip, for two groups of recordings, or for no targets. The same input gives the same figures, whatever
// the number of threads.
void steer_to_targets(const diagnosis::RecordedCase& recorded, const io::ModelFile& in_use, const io::ModelFile& found,
                      const SteeringOptions& options, diagnosis::Findings& findings);

}  // namespace bevel::analysis
