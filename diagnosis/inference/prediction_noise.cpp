#include "diagnosis/inference/prediction_noise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/inference/minimum.hpp"
#include "diagnosis/inference/recording_rows.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kSteps = 20;
constexpr double kAlike = 0.01;  // of a standard deviation, as a share, and of an autocorrelation
constexpr double kLargestAr1 = 0.98;

// One recording's columns in the channels' units.
struct Raw {
  MatrixXd Z, L;
  VectorXd e;
};

std::vector<Raw> raw_of(const LinearModel& model, const CurveColumns& curve) {
  const Fit& fit = *model.fit;
  std::vector<Raw> out;
  for (std::size_t r = 0; r < fit.local.size(); ++r) {
    LinearRecording linear;
    if (!linearise(*fit.likelihood, fit, curve, r, linear)) return {};
    const RecordingRows rows(*fit.likelihood, r, std::numeric_limits<double>::infinity());
    Raw one{.Z = rows.coloured(linear.Z, false), .L = rows.coloured(linear.L, false), .e = {}};
    one.e = rows.coloured(linear.residuals.white, false);
    if (const Index means = model.mean.size(); means > 0) {
      one.Z.conservativeResize(Eigen::NoChange, one.Z.cols() + means);
      one.Z.rightCols(means) = one.L.leftCols(means);
    }
    out.push_back(std::move(one));
  }
  return out;
}

ArrowBlock block_of(const Raw& raw, const SeriesSet& set, const Noise& noise) {
  Raw white = raw;
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

// Errors at the mode in the first column, then what the unknowns' spread does to them: the expected square is the sum
// of the columns'.
MatrixXd errors_of(const Raw& raw, const ArrowBlock& block, const ArrowSolution& solution, std::size_t r) {
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
  MatrixXd out(raw.e.size(), 1 + raw.Z.cols() + raw.L.cols());
  out << raw.e - raw.Z * solution.shared - raw.L * solution.local[r], (raw.Z - raw.L * through) * root,
      turned.transpose();
  return out;
}

// The likeliest noise of one channel by such errors, recording after recording.
void maximise(const std::vector<const Series*>& series, const std::vector<MatrixXd>& errors, std::size_t channel,
              Noise& noise) {
  const auto deviance_at = [&](double ar1, double& sigma) {
    Noise one = noise.of(channel);
    one.ar1 = ar1, one.ar2 = 0;
    double squares = 0, count = 0, logs = 0;
    for (std::size_t r = 0; r < series.size(); ++r) {
      if (errors[r].rows() == 0) continue;
      const Whitening whitening = make_whitening(*series[r], one, 1.0);
      MatrixXd white = errors[r];
      whiten(whitening, white);
      squares += white.squaredNorm();
      count += static_cast<double>(white.rows());
      for (const double weight : whitening.weight) logs -= 2 * std::log(weight);
    }
    sigma = std::sqrt(std::max(squares / std::max(count, 1.0), 1e-18));
    return 2 * count * std::log(sigma) + logs;
  };
  constexpr double kWidth = 0.003;
  double sigma = 0;
  const double found = minimum_of(0, kLargestAr1, kWidth, [&](double ar1) { return deviance_at(ar1, sigma); });
  noise.own_ar1[channel] = found <= 0.5 * kWidth ? 0 : found;  // nothing was found to lie above it
  deviance_at(noise.own_ar1[channel], noise.sigma[channel]);
}

// Each group's standard deviation in turn at its likeliest.
ArrowSolution solve_at_likeliest(const LinearModel& model, std::vector<ArrowBlock>& blocks, Pulls& pulls,
                                 const ArrowRules& rules, bool seek, VectorXd& nuisance_sd) {
  const Layout& layout = model.fit->layout;
  const auto& groups = layout.system().nuisance_groups();
  const auto at = [&](const VectorXd& sd, bool covariance) {
    const VectorXd precision = local_precision_of(layout, {.nuisance_sd = sd, .curves = {}});
    for (ArrowBlock& block : blocks) block.precision = precision;
    if (model.mean.size() > 0)
      pulls.precision.diagonal().tail(model.mean.size()) = mean_precision_of(layout.system(), sd);
    ArrowRules how = rules;
    if (covariance) how.covariance_of.reset();
    return solve(blocks, pulls.precision, pulls.centre, how);
  };
  for (std::size_t g = 0; seek && g < groups.size(); ++g) {
    const auto& values = groups[g].standard_deviations;
    double most = -std::numeric_limits<double>::infinity(), best = nuisance_sd[static_cast<Index>(g)];
    for (const double value : values) {
      VectorXd trial = nuisance_sd;
      trial[static_cast<Index>(g)] = value;
      const ArrowSolution one = at(trial, false);
      if (!one.valid) continue;
      const double prior =
          value == values.front() ? 0 : -std::log(std::max<double>(1, static_cast<double>(values.size() - 1)));
      const double log = prior - 0.5 * (one.least + one.log_volume_ratio);
      if (log > most) most = log, best = value;
    }
    nuisance_sd[static_cast<Index>(g)] = best;
  }
  return at(nuisance_sd, true);
}

}  // namespace

Noise prediction_noise(const LinearModel& model, const CurveColumns& curve) {
  const Fit& fit = *model.fit;
  const Dataset& data = fit.likelihood->data();
  const auto raw = raw_of(model, curve);
  Noise noise = fit.likelihood->noise();
  if (raw.empty()) return noise;
  const std::size_t channels = noise.sigma.size();
  noise.own_ar1.assign(channels, noise.ar1);
  Pulls pulls = pulls_with_mean(pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance), model.mean);
  ArrowRules rules{.held = fit.held, .covariance_of = std::vector<Index>{}};
  // To begin with they may differ by all that is tried: the noise is what that leaves, and not the other way.
  VectorXd nuisance_sd = fit.scales.nuisance_sd;
  for (Index g = 0; g < nuisance_sd.size(); ++g)
    nuisance_sd[g] = fit.layout.system().nuisance_groups()[static_cast<std::size_t>(g)].standard_deviations.back();
  std::vector<ArrowBlock> blocks(raw.size());
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t r = 0; r < raw.size(); ++r) {
      blocks[r] = block_of(raw[r], data.recordings[r], noise);
      blocks[r].centre = model.blocks[r].centre;
    }
    const ArrowSolution solution = solve_at_likeliest(model, blocks, pulls, rules, step > 0, nuisance_sd);
    if (!solution.valid) break;
    std::vector<std::vector<MatrixXd>> errors(channels, std::vector<MatrixXd>(raw.size()));
    std::vector<std::vector<const Series*>> series(channels, std::vector<const Series*>(raw.size()));
    for (std::size_t r = 0; r < raw.size(); ++r) {
      const MatrixXd all = errors_of(raw[r], blocks[r], solution, r);
      Index row = 0;
      for (std::size_t c = 0; c < channels; ++c) {
        series[c][r] = &data.recordings[r].series[c];
        const auto count = static_cast<Index>(series[c][r]->time_s.size());
        errors[c][r] = all.middleRows(row, count);
        row += count;
      }
    }
    const Noise before = noise;
    for (std::size_t c = 0; c < channels; ++c) maximise(series[c], errors[c], c, noise);
    double change = 0;
    for (std::size_t c = 0; c < channels; ++c)
      change = std::max({change, std::abs(std::log(noise.sigma[c] / before.sigma[c])),
                         std::abs(noise.own_ar1[c] - before.own_ar1[c])});
    if (change < kAlike) break;
  }
  return noise;
}

}  // namespace bevel::inference
