// SPDX-License-Identifier: MIT
// The simulated rig beside its recordings: plant and cameras moved as the base was, nothing corrected on the way.
#pragma once

#include <string>
#include <vector>

#include <bevel/diagnosis/inference/noise.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

struct RigRecording {
  std::string log;
  double rmse_mm = 0, chi2_per_reading = 0;
};

struct RigFigure {
  double rmse_mm = 0, max_mm = 0;  // of scalar readings
  double chi2_per_reading = 0;     // whitened by the noise found: 1 where only that noise is left
  std::size_t readings = 0;
  std::vector<RigRecording> recordings;
};

// Along the needle that all insertions share: what each recording's had of its own nobody knows, and its share of the
// error stays in the figure.
RigFigure simulate_rig(const diagnosis::RecordedCase& recorded, const inference::Noise& noise,
                       const io::ModelFile& model);

// What the rig's cameras report at each reading of a recording, without noise.
std::vector<Eigen::Vector3d> simulate_recording(const diagnosis::Recording& recording, const io::ModelFile& model);

}  // namespace bevel::analysis
