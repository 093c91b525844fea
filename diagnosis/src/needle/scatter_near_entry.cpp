// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/needle/scatter_near_entry.hpp>

#include <Eigen/QR>
#include <array>
#include <cmath>

#include <bevel/model/effects/discrepancy.hpp>
#include "inference/minimum.hpp"

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kByChance = 13.8;  // chi2 of two degrees of freedom, once in 1000
constexpr int kSharedKnots = 8;     // of the path that recordings share
constexpr double kFewestPerColumn = 2;
// A guide lets go within a stop or two; tissue holds a shaft after some tens of millimetres.
constexpr std::array kLengths_mm{3.0, 6.0, 12.0, 25.0, 50.0};
constexpr double kLargestLogExcess =
    4.6;  // a standard deviation of ten times that deep down: the most that is reported

// All of a channel's readings, in the claimed standard deviations deep down, and what may be anything.
struct Rows {
  VectorXd depth_mm, reading;
  MatrixXd free;
};

double depth_of(const Recording& recording, std::size_t message) {
  return recording.motion.nodes[recording.motion.at[message]].insertion_mm;
}

Rows rows_of(const RecordedCase& recorded, std::size_t c) {
  const Index own = recorded.channels[c].heading ? 2 : 3;
  Index count = 0;
  for (const Recording& recording : recorded.recordings)
    count += static_cast<Index>(recording.series[c].measured.size());
  const int groups = recorded.two_groups() ? 2 : 1;
  const auto recordings = static_cast<Index>(recorded.recordings.size());
  Rows out{.depth_mm = VectorXd(count),
           .reading = VectorXd(count),
           .free = MatrixXd::Zero(count, own * recordings + groups * kSharedKnots)};
  const double deepest_mm = std::max(recorded.deepest_mm(), 1e-9);
  std::vector<double> knots;
  for (int k = 0; k < kSharedKnots; ++k) knots.push_back(static_cast<double>(k) / (kSharedKnots - 1));
  Index row = 0;
  for (std::size_t r = 0; r < recorded.recordings.size(); ++r) {
    const Recording& recording = recorded.recordings[r];
    const Series& series = recording.series[c];
    for (std::size_t i = 0; i < series.measured.size(); ++i, ++row) {
      out.depth_mm[row] = depth_of(recording, series.message[i]);
      const double depth = out.depth_mm[row] / deepest_mm, weight = 1 / series.relative_sd[i];
      out.reading[row] = weight * series.measured[i];
      for (Index power = 0; power < own; ++power)
        out.free(row, own * static_cast<Index>(r) + power) = weight * std::pow(depth, power);
      const auto at = model::weights_at(knots, false, depth);
      for (std::size_t k = 0; k < 2; ++k)
        out.free(row, own * recordings + (recording.changed ? kSharedKnots : 0) + static_cast<Index>(at.knot[k])) +=
            weight * at.weight[k];
    }
  }
  // The shared path and the recordings' parabolas have parabolas in common: a basis of all of it.
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(out.free);
  out.free = qr.householderQ() * MatrixXd::Identity(count, qr.rank());
  return out;
}

// Minus twice the restricted log-likelihood, with the standard deviation deep down at its best.
double deviance(const Rows& rows, const ScatterNearEntry& scatter) {
  const VectorXd weight =
      rows.depth_mm.unaryExpr([&](double depth_mm) { return 1 / std::sqrt(scatter.variance_at(depth_mm)); });
  const Eigen::HouseholderQR<MatrixXd> qr(weight.asDiagonal() * rows.free);
  const VectorXd rotated = qr.householderQ().transpose() * weight.cwiseProduct(rows.reading).eval();
  const Index left = rotated.size() - rows.free.cols();
  double out = static_cast<double>(left) *
                   std::log(std::max(rotated.tail(left).squaredNorm() / static_cast<double>(left), 1e-18)) -
               2 * weight.array().log().sum();
  for (Index i = 0; i < rows.free.cols(); ++i) out += 2 * std::log(std::abs(qr.matrixQR()(i, i)));
  return out;
}

}  // namespace

std::vector<ScatterNearEntry> find_scatter_near_entry(const RecordedCase& recorded) {
  std::vector<ScatterNearEntry> out(recorded.channels.size());
  for (std::size_t c = 0; c < out.size(); ++c) {
    const Rows rows = rows_of(recorded, c);
    if (static_cast<double>(rows.free.rows()) < kFewestPerColumn * static_cast<double>(rows.free.cols())) continue;
    double least = deviance(rows, {}) - kByChance;
    for (const double length_mm : kLengths_mm) {
      const auto at = [&](double log_excess) { return deviance(rows, {std::exp(log_excess), length_mm}); };
      const double found = inference::minimum_of(-2, kLargestLogExcess, 0.1, at);
      if (const double here = at(found); here < least) least = here, out[c] = {std::exp(found), length_mm};
    }
  }
  return out;
}

void widen_near_entry(RecordedCase& recorded) {
  const auto scatter = find_scatter_near_entry(recorded);
  for (std::size_t c = 0; c < scatter.size(); ++c) {
    recorded.channels[c].scatter = scatter[c];
    if (!(scatter[c].length_mm > 0)) continue;
    for (Recording& recording : recorded.recordings) {
      Series& series = recording.series[c];
      for (std::size_t i = 0; i < series.relative_sd.size(); ++i)
        series.relative_sd[i] *= std::sqrt(scatter[c].variance_at(depth_of(recording, series.message[i])));
    }
  }
}

}  // namespace bevel::diagnosis
