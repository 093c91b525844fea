// SPDX-License-Identifier: MIT
#include "mismatch/checks.hpp"

#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/inference/outliers.hpp>
#include <bevel/diagnosis/statistics/ljung_box.hpp>

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Noise that a smoothing curve leaves of the final model's residuals. A curve through the errors of the nominal model
/// does not follow sudden motion (a tip that sticks and jumps) and takes it for noise.
inference::Noise noise_around(const ChosenModel& model, const inference::Noise& start) {
  const inference::Fit& fit = *model.fit;
  const inference::Dataset& data = fit.likelihood->data();
  inference::Errors errors;
  for (std::size_t r = 0; r < data.recordings.size(); ++r) {
    const VectorXd all = fit.likelihood->errors(fit.layout, r, fit.shared, fit.local[r], model.curve, fit.curve_values);
    if (all.size() != data.recordings[r].rows()) return start;
    errors.push_back(by_channel(data.recordings[r], all));
  }
  return inference::calibrate_noise(data, errors).noise;
}

}  // namespace

Checks check_model(const inference::Search& search, const ChosenModel& model, const inference::Readings& outliers,
                   const inference::Noise& start) {
  constexpr int kLags = 12;  // at most, and a third of the readings
  constexpr Index kFewest = 8;
  constexpr double kBandQuantile = 2.576, kChance = 0.01;
  Checks out;
  const inference::Fit& fit = *model.fit;
  const inference::Likelihood by_measured(search.system(), outliers, noise_around(model, start));
  const auto curve = search.discrepancy().columns(by_measured, fit);
  inference::Residuals residuals;
  double chi2 = 0, count = 0, smallest_p = 1;
  int series_count = 0;
  for (std::size_t r = 0; r < by_measured.recordings(); ++r) {
    if (!by_measured.evaluate(fit.layout, r, fit.shared, fit.local[r], false, residuals, curve, fit.curve_values))
      continue;
    chi2 += residuals.white.squaredNorm();
    count += static_cast<double>(residuals.white.size());
    if (!fit.likelihood->evaluate(fit.layout, r, fit.shared, fit.local[r], false, residuals, model.curve,
                                  fit.curve_values))
      continue;
    for (const auto& white : by_channel(fit.likelihood->data().recordings[r], residuals.white)) {
      if (white.size() < kFewest) continue;
      const auto& noise = fit.likelihood->noise();
      const int lags = std::min(kLags, static_cast<int>(white.size()) / 3);
      const int fitted = (noise.ar1 > 0 ? 1 : 0) + (noise.ar2 != 0 ? 1 : 0);
      smallest_p = std::min(smallest_p, ljung_box(white, lags, fitted).p_value);
      ++series_count;
    }
  }
  out.chi2_per_dof = chi2 / std::max(count, 1.0);
  // Noise and model were found on these same readings: the noise's own variance is in the band.
  const double sd = std::sqrt(4 / std::max(count, 1.0));
  out.band = {1 - kBandQuantile * sd, 1 + kBandQuantile * sd};
  // Series too short to be tested say nothing against it.
  out.ljung_box_p = series_count > 0 ? std::min(1.0, smallest_p * series_count) : 1;
  out.clean = out.chi2_per_dof > out.band[0] && out.chi2_per_dof < out.band[1] && out.ljung_box_p > kChance;
  return out;
}

}  // namespace bevel::diagnosis
