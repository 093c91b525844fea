#include "diagnosis/inference/error_spread.hpp"

#include <Eigen/Cholesky>
#include <limits>

#include "diagnosis/inference/recording_rows.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kSteps = 3;  // of the noise, about one fit; the next fit goes on
}  // namespace

std::vector<RawRows> raw_rows(const Fit& fit, const CurveColumns& curve) {
  std::vector<RawRows> out;
  for (std::size_t r = 0; r < fit.local.size(); ++r) {
    LinearRecording linear;
    if (!linearise(*fit.likelihood, fit, curve, r, linear)) return {};
    const RecordingRows rows(*fit.likelihood, r, std::numeric_limits<double>::infinity());
    out.push_back({.Z = rows.coloured(linear.Z, false),
                   .L = rows.coloured(linear.L, false),
                   .e = rows.coloured(linear.residuals.white, false)});
  }
  return out;
}

ArrowBlock block_by(const RawRows& raw, const SeriesSet& set, const Noise& noise) {
  RawRows white = raw;
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
  MatrixXd inner = block.ll;
  inner.diagonal() += block.precision;
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

Noise noise_beside(const Fit& fit, const CurveColumns& curve) {
  Noise noise = fit.likelihood->noise();
  const auto raw = raw_rows(fit, curve);
  if (raw.empty()) return noise;
  const Dataset& data = fit.likelihood->data();
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance);
  VectorXd precision = local_precision_of(fit.layout, fit.scales);
  hold_scanned(fit.layout, precision);
  ArrowRules rules;
  rules.held = fit.held;
  std::vector<ArrowBlock> blocks(raw.size());
  std::vector<std::vector<ExpectedErrors>> errors(raw.size());
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t r = 0; r < raw.size(); ++r) {
      blocks[r] = block_by(raw[r], data.recordings[r], noise);
      blocks[r].precision = precision;
      blocks[r].centre = nuisance_centre(fit.layout, fit.local[r]);
    }
    const ArrowSolution solution = solve(blocks, pulls.precision, pulls.centre, rules);
    if (!solution.valid) break;
    for (std::size_t r = 0; r < raw.size(); ++r)
      errors[r] = expected_errors(raw[r], data.recordings[r], blocks[r], solution, r);
    const Noise before = noise;
    noise = refine_noise(data, errors, before);
    if (alike(noise, before)) break;
  }
  return noise;
}

}  // namespace bevel::inference
