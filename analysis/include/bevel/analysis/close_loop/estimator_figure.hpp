// SPDX-License-Identifier: MIT
// The estimator on the case's recordings: are its innovations those of a model that leaves nothing out?
#pragma once

#include <array>
#include <string>
#include <vector>

#include <bevel/analysis/replay/statistics.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/estimator/config.hpp>
#include <bevel/io/model_file.hpp>

namespace bevel::analysis {

// Innovations of accepted measurements, with the camera's correlation taken out.
struct EstimatorFigure {
  ChiSquareMean nis;                  // all axes
  std::array<ChiSquareMean, 3> axis;  // x, y, z
  int series = 0, coloured = 0;       // Ljung-Box at 1 %, one series per axis and recording
  int coloured_by_chance = 0;         // no more of so many white series look coloured 99 times in 100
  std::int64_t measurements = 0, rejected = 0, resets = 0;
  std::vector<double> nis_by_recording;

  bool consistent() const { return nis.in_band() && coloured <= coloured_by_chance; }
};

// The cameras' noise per axis of {A}, as bevel-replay measures it: without a model, and with no regard to outliers.
std::vector<NoiseColour> measure_noise(const std::vector<std::string>& logs, const io::ModelFile& model,
                                       estimator::EstimatorConfig config);

// `config` says how well entry and needle are known beforehand and what the filter forgives; the mean of the needle and
// the effects are the model's.
EstimatorFigure replay_case(const std::vector<std::string>& logs, const io::ModelFile& model,
                            const std::vector<NoiseColour>& noise, estimator::EstimatorConfig config);

// `config` with k and lambda as well known as a fit over all recordings at once knows them. Where each recording may
// choose its own, they take over what is missing: a recording alone cannot tell windup from another k.
estimator::EstimatorConfig with_needle_known(estimator::EstimatorConfig config, const diagnosis::NeedleEstimate& known);

}  // namespace bevel::analysis
