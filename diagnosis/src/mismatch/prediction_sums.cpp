// SPDX-License-Identifier: MIT
#include "mismatch/prediction_sums.hpp"

#include <algorithm>
#include <cmath>

namespace bevel::diagnosis {

using Eigen::Index;

FitFigures figures_of(const std::vector<Sums>& all) {
  FitFigures out;
  Sums sum;
  for (const Sums& one : all) {
    sum.squares += one.squares, sum.positions += one.positions;
    sum.chi2 += one.chi2, sum.log_density += one.log_density, sum.count += one.count;
    out.max_mm = std::max(out.max_mm, one.largest);
  }
  const double n = std::max(sum.count, 1.0), positions = std::max(sum.positions, 1.0);
  out.rmse_mm = std::sqrt(sum.squares / positions);
  out.chi2_per_dof = sum.chi2 / n;
  out.log_density = sum.log_density / n;
  if (all.size() < 2) return out;
  // From recording to recording, weighed by their readings: of the mean square, and of the mean logarithm.
  double square = 0, log = 0;
  for (const Sums& one : all) {
    square += std::pow(one.squares - one.positions * sum.squares / positions, 2);
    log += std::pow(one.log_density - one.count * out.log_density, 2);
  }
  const auto r = static_cast<double>(all.size());
  const double error = std::sqrt(square * r / (r - 1)) / positions;
  out.rmse_se_mm = out.rmse_mm > 0 ? error / (2 * out.rmse_mm) : 0;
  out.log_density_se = std::sqrt(log * r / (r - 1)) / n;
  return out;
}

PredictionSums::PredictionSums(const NeedleSystem& system)
    : recorded_(&system.recorded()), channels_(system.recorded().channels.size()) {}

void PredictionSums::add(const inference::SeriesSet& recording, const inference::Forecast& forecast) {
  constexpr double kTail = 0.025;
  std::vector<std::size_t> channel_of;
  for (std::size_t c = 0; c < recording.series.size(); ++c)
    channel_of.insert(channel_of.end(), recording.series[c].time_s.size(), c);
  for (std::size_t i = 0; i < forecast.rows.size(); ++i) {
    Channel& sums = channels_[channel_of[static_cast<std::size_t>(forecast.rows[i])]];
    const auto at = static_cast<Index>(i);
    sums.squares += forecast.error[at] * forecast.error[at];
    sums.inside += forecast.below[at] > kTail && forecast.below[at] < 1 - kTail ? 1 : 0;
    ++sums.count;
  }
  log_density_ += forecast.log_density;
}

PredictionFigures PredictionSums::figures() const {
  PredictionFigures out;
  Channel all, positions;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const Channel& one = channels_[c];
    out.channels.push_back({.rmse = std::sqrt(one.squares / one.count), .share_in_95 = one.inside / one.count});
    all.inside += one.inside, all.count += one.count;
    if (!recorded_->channels[c].heading) positions.squares += one.squares, positions.count += one.count;
  }
  out.rmse_mm = std::sqrt(positions.squares / positions.count);
  out.log_density = log_density_ / all.count;
  out.share_in_95 = all.inside / all.count;
  out.readings = static_cast<std::size_t>(all.count);
  return out;
}

void InsertionSums::add(const inference::SeriesSet& recording, const inference::Forecasts& one) {
  whole_.add(recording, one.all);
  if (one.continued.rows.empty()) return;
  beyond_.add(recording, one.beyond);
  continued_.add(recording, one.continued);
}

InsertionPredicted InsertionSums::figures() const {
  return {.whole = whole_.figures(), .beyond = beyond_.figures(), .continued = continued_.figures()};
}

}  // namespace bevel::diagnosis
