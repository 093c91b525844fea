// SPDX-License-Identifier: MIT
#include "mismatch/onset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kUnseen = 0.01;      // chi2: a tenth of a standard deviation
constexpr double kRejected = 3.84;    // chi2 with one degree of freedom, 95 %
constexpr double kLongest = 0.5;      // of the recording
constexpr double kBaseline_mm = 0.5;  // depth between two places from which a direction is computed
constexpr std::size_t kMostTimes = 100;

// One row of a recording: a channel's measurement.
struct Row {
  double time_s = 0, depth_mm = 0;
};

// Rows by channel, in time.
std::vector<std::vector<Row>> rows_of(const NeedleSystem& system, std::size_t r) {
  const Recording& recording = system.recorded().recordings[r];
  const auto covariates = model::find_covariates(recording.motion.nodes);
  std::vector<std::vector<Row>> out;
  for (const auto& series : system.data().recordings[r].series) {
    out.emplace_back();
    for (std::size_t i = 0; i < series.time_s.size(); ++i)
      out.back().push_back(
          {.time_s = series.time_s[i],
           .depth_mm = covariates[recording.motion.at[series.message[i]]][model::Covariate::depth_mm]});
  }
  return out;
}

// Computes what the physics adds to the rows of one channel if it begins at t0: its effect, less the continuation of
// the position and direction that it had reached there.
void begin_at(double t0_s, const std::vector<Row>& rows, bool heading, Eigen::Ref<VectorXd> effect) {
  Index at = -1;
  for (std::size_t i = 0; i < rows.size() && rows[i].time_s <= t0_s; ++i) at = static_cast<Index>(i);
  if (at < 0) return;
  const auto depth = [&](Index i) { return rows[static_cast<std::size_t>(i)].depth_mm; };
  Index before = at;
  while (before > 0 && std::abs(depth(at) - depth(before)) < kBaseline_mm) --before;
  const double advance = depth(at) - depth(before);
  const double slope = heading || std::abs(advance) < kBaseline_mm ? 0 : (effect[at] - effect[before]) / advance;
  const double there = effect[at];
  for (Index i = 0; i < effect.size(); ++i) effect[i] -= i <= at ? effect[i] : there + slope * (depth(i) - depth(at));
}

// The measurements' rows, with and without the physics; false outside the model's domain.
bool predict_both(const NeedleSystem& system, const ChosenModel& model, std::size_t r, VectorXd& with,
                  VectorXd& without) {
  const inference::Fit& fit = *model.fit;
  const inference::Layout nothing(system, {});
  inference::Prediction prediction;
  if (!system.predict_with(fit.layout.set(), r, fit.shared, fit.local[r], model.discrepancy, false, prediction,
                           nullptr))
    return false;
  with = prediction.reading;
  if (!system.predict({}, r, nothing.shared_from(fit.layout, fit.shared), nothing.local_from(fit.layout, fit.local[r]),
                      false, prediction))
    return false;
  without = prediction.reading;
  return true;
}

VectorXd measured_of(const NeedleSystem& system, std::size_t r) {
  std::vector<double> out;
  for (const auto& series : system.data().recordings[r].series)
    out.insert(out.end(), series.measured.begin(), series.measured.end());
  return Eigen::Map<const VectorXd>(out.data(), static_cast<Index>(out.size()));
}

}  // namespace

std::optional<Onset> onset_of(const NeedleSystem& system, const ChosenModel& model, std::size_t r) {
  VectorXd with, without;
  if (!predict_both(system, model, r, with, without)) return std::nullopt;
  const auto rows = rows_of(system, r);
  std::vector<double> all_times, times;
  for (const auto& channel : rows)
    for (const Row& row : channel) all_times.push_back(row.time_s);
  std::ranges::sort(all_times);
  all_times.erase(std::unique(all_times.begin(), all_times.end()), all_times.end());
  if (all_times.size() < 2) return std::nullopt;
  const std::size_t stride = (all_times.size() + kMostTimes - 1) / kMostTimes;
  for (std::size_t i = 0; i < all_times.size(); i += stride) times.push_back(all_times[i]);
  // Columns: the nominal model's errors, the physics from the beginning, and from each time on.
  const auto count = static_cast<Index>(times.size());
  MatrixXd columns(with.size(), 2 + count);
  columns.col(0) = measured_of(system, r) - without;
  for (Index k = 1; k < columns.cols(); ++k) columns.col(k) = with - without;
  for (Index k = 0; k < count; ++k) {
    Index first = 0;
    for (std::size_t c = 0; c < rows.size(); ++c) {
      const auto size = static_cast<Index>(rows[c].size());
      begin_at(times[static_cast<std::size_t>(k)], rows[c], system.recorded().channels[c].heading,
               columns.col(2 + k).segment(first, size));
      first += size;
    }
  }
  const MatrixXd white = model.fit->likelihood->whitened(r, columns);
  const double best = (white.col(0) - white.col(1)).squaredNorm();
  Onset out{.from_s = all_times.front(), .to_s = std::numeric_limits<double>::infinity()};
  for (Index k = 0; k < count; ++k) {
    const double time_s = times[static_cast<std::size_t>(k)];
    if ((white.col(1) - white.col(2 + k)).squaredNorm() < kUnseen) out.from_s = time_s;
    if ((white.col(0) - white.col(2 + k)).squaredNorm() - best > kRejected && time_s > all_times.front()) {
      out.to_s = time_s;
      break;
    }
  }
  out.from_s = std::min(out.from_s, out.to_s);
  if (!(out.to_s - out.from_s <= kLongest * (all_times.back() - all_times.front()))) return std::nullopt;
  return out;
}

}  // namespace bevel::diagnosis
