// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/error_spread.hpp>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numeric>

#include <bevel/diagnosis/inference/recording_rows.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kSteps = 3;      // of the noise, about one fit; the next fit goes on
constexpr double kAtMode = 2;  // of the cost: what the linear model says is left to gain at a mode
}  // namespace

std::vector<RawRows> raw_rows(const Fit& fit, const CurveColumns& curve) {
  std::vector<RawRows> out;
  for (std::size_t r = 0; r < fit.local.size(); ++r) {
    LinearRecording linear;
    if (!linearise(*fit.likelihood, fit, curve, r, linear)) return {};
    const RecordingRows rows(*fit.likelihood, r, std::numeric_limits<double>::infinity());
    out.push_back({.Z = rows.coloured(linear.Z, false),
                   .L = rows.coloured(linear.L, false),
                   .e = rows.coloured(linear.residuals.white, false),
                   .block = std::move(linear.block)});
  }
  return out;
}

ArrowBlock block_by(const RawRows& raw, const SeriesSet& set, const Noise& noise) {
  RawRows white{.Z = raw.Z, .L = raw.L, .e = raw.e, .block = {}};
  Index row = 0;
  for (std::size_t c = 0; c < set.series.size(); ++c) {
    const Whitening whitening = make_whitening(set.series[c], noise.of(c), noise.sigma[c]);
    const auto count = static_cast<Index>(whitening.weight.size());
    whiten(whitening, white.Z.middleRows(row, count));
    whiten(whitening, white.L.middleRows(row, count));
    whiten(whitening, white.e.segment(row, count));
    row += count;
  }
  return make_block(white.L, white.Z, white.e);
}

std::vector<ExpectedErrors> expected_errors(const RawRows& raw, const SeriesSet& set, const ArrowBlock& block,
                                            const ArrowSolution& solution, std::size_t recording) {
  const MatrixXd inner = block.own_information();
  const VectorXd unit = inner.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<MatrixXd> own(unit.asDiagonal() * inner * unit.asDiagonal());
  const MatrixXd through = unit.asDiagonal() * own.solve(unit.asDiagonal() * block.lz);
  const VectorXd deviation = solution.covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const VectorXd per = deviation.cwiseInverse();
  const MatrixXd correlation = per.asDiagonal() * solution.covariance * per.asDiagonal();
  const Eigen::LDLT<MatrixXd> shared(correlation);
  const MatrixXd lower = shared.matrixL();
  const MatrixXd root = deviation.asDiagonal() * (shared.transpositionsP().transpose() * lower) *
                        shared.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  MatrixXd turned = (raw.L * unit.asDiagonal()).transpose();
  own.matrixL().solveInPlace(turned);
  MatrixXd columns(raw.e.size(), 1 + raw.Z.cols() + raw.L.cols());
  columns << raw.e - raw.Z * solution.shared - raw.L * solution.local[recording], (raw.Z - raw.L * through) * root,
      turned.transpose();
  std::vector<ExpectedErrors> out;
  Index row = 0;
  for (const Series& series : set.series) {
    const auto count = static_cast<Index>(series.time_s.size());
    out.emplace_back(columns.middleRows(row, count));
    row += count;
  }
  return out;
}

namespace {

ByReading precision_in(const Dataset& data) {
  ByReading out;
  for (const SeriesSet& set : data.recordings) {
    auto& own = out.emplace_back();
    for (const Series& series : set.series) own.push_back(series.precision);
  }
  return out;
}

// How heavy the tails are, and each innovation's precision by its expected square.
void refine_tails(const ErrorsByChannel& errors, Dataset& data, Noise& noise) {
  std::vector<double> squares;
  for (std::size_t r = 0; r < errors.size(); ++r)
    for (std::size_t c = 0; c < errors[r].size(); ++c) {
      Series& series = data.recordings[r].series[c];
      series.precision.clear();
      const VectorXd own = errors[r][c].whitened_squares(make_whitening(series, noise.of(c), noise.sigma[c]));
      squares.insert(squares.end(), own.begin(), own.end());
    }
  // The deviation is that of all; how it is shared among the channels, the weights say.
  const double mean = std::accumulate(squares.begin(), squares.end(), 0.0) / static_cast<double>(squares.size());
  for (double& square : squares) square /= mean;
  for (double& sigma : noise.sigma) sigma *= std::sqrt(mean);
  noise.tails = likeliest_tails(squares);
  noise.tails_are_open = true;
  if (noise.tails.degrees == 0) return;
  std::size_t next = 0;
  for (SeriesSet& set : data.recordings)
    for (Series& series : set.series)
      while (series.precision.size() < series.time_s.size())
        series.precision.push_back(precision_of(squares[next++], noise.tails));
}

}  // namespace

bool alike(const NoiseBeside& a, const Likelihood& b) {
  constexpr double kMeanShare = 0.02;  // of a precision
  if (!alike(a.noise, b.noise())) return false;
  double change = 0, count = 0;
  for (std::size_t r = 0; r < a.precision.size(); ++r)
    for (std::size_t c = 0; c < a.precision[r].size(); ++c) {
      const auto& now = a.precision[r][c];
      const auto& before = b.data().recordings[r].series[c].precision;
      for (std::size_t i = 0; i < now.size(); ++i) change += std::abs(now[i] - (before.empty() ? 1 : before[i]));
      count += static_cast<double>(now.size());
    }
  return change <= kMeanShare * count;
}

namespace {

bool is_at_mode(const Fit& fit, const CurveColumns& curve, const std::vector<RawRows>& raw) {
  std::vector<ArrowBlock> blocks;
  for (const RawRows& one : raw) blocks.push_back(one.block);
  return !blocks.empty() && fit.cost - solve_about(fit, blocks, curve, std::vector<Index>{}).least < kAtMode;
}

// Of all recordings by a noise; none outside the model's domain.
class ErrorsBeside {
 public:
  ErrorsBeside(const Fit& fit, const CurveColumns& curve)
      : fit_(&fit),
        raw_(raw_rows(fit, curve)),
        pulls_(pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance)),
        precision_(local_precision_of(fit.layout, fit.scales)),
        at_mode_(is_at_mode(fit, curve, raw_)) {
    hold_scanned(fit.layout, precision_);
  }
  ErrorsByChannel by(const Dataset& data, const Noise& noise) const {
    std::vector<ArrowBlock> blocks(raw_.size());
    parallel_for(raw_.size(), [&](std::size_t r) {
      blocks[r] = block_by(raw_[r], data.recordings[r], noise);
      blocks[r].precision = precision_;
      blocks[r].centre = nuisance_centre(fit_->layout, fit_->local[r]);
    });
    if (blocks.empty()) return {};
    ArrowRules rules;
    rules.held = fit_->held;
    ArrowSolution solution = solve(blocks, pulls_.precision, pulls_.centre, rules);
    if (!solution.valid) return {};
    // A fit that was left on its way has the errors that it has, not those where its linear model would go.
    if (!at_mode_) {
      solution.shared.setZero();
      for (VectorXd& own : solution.local) own.setZero();
    }
    ErrorsByChannel out(raw_.size());
    parallel_for(raw_.size(),
                 [&](std::size_t r) { out[r] = expected_errors(raw_[r], data.recordings[r], blocks[r], solution, r); });
    return out;
  }

 private:
  const Fit* fit_;
  std::vector<RawRows> raw_;
  Pulls pulls_;
  VectorXd precision_;
  bool at_mode_;
};

}  // namespace

NoiseBeside noise_beside(const Fit& fit, const CurveColumns& curve) {
  Noise noise = fit.likelihood->noise();
  Dataset data = fit.likelihood->data();
  const ErrorsBeside errors(fit, curve);
  for (int step = 0; step < kSteps; ++step) {
    const ErrorsByChannel now = errors.by(data, noise);
    if (now.empty()) break;
    const Noise before = noise;
    noise = refine_noise(data, now, before);
    // Normal as they may be now: what a set leaves without its curve hides them.
    if (noise.tails_are_open) refine_tails(now, data, noise);
    if (alike(noise, before)) break;
  }
  return {.noise = noise, .precision = precision_in(data)};
}

NoiseBeside tails_beside(const Fit& fit, const CurveColumns& curve) {
  Noise noise = fit.likelihood->noise();
  Dataset data = fit.likelihood->data();
  const ErrorsByChannel errors = ErrorsBeside(fit, curve).by(data, noise);
  if (!errors.empty()) refine_tails(errors, data, noise);
  return {.noise = noise, .precision = precision_in(data)};
}

}  // namespace bevel::inference
