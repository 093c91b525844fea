// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/predictive.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include <bevel/diagnosis/inference/log_sum.hpp>
#include <bevel/diagnosis/inference/recording_rows.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Beside the priors of what is shared, that of the mean of the nuisances: where it is no unknown, nothing.
Pulls pulls_with_mean(const Pulls& pulls, const VectorXd& mean) {
  const Index n = pulls.centre.size(), all = n + mean.size();
  Pulls out{.precision = MatrixXd::Zero(all, all), .centre = VectorXd(all)};
  out.precision.topLeftCorner(n, n) = pulls.precision;
  out.centre << pulls.centre, -mean;
  return out;
}
// Precision of the nuisances' mean: normal by the widest standard deviation that is tried, none where they do not vary.
VectorXd mean_precision_of(const System& system, const VectorXd& nuisance_sd) {
  VectorXd out(static_cast<Index>(system.nuisances().size()));
  for (std::size_t i = 0; i < system.nuisances().size(); ++i) {
    const std::size_t group = system.nuisances()[i].group;
    const auto& values = system.nuisance_groups()[group].standard_deviations;
    const double sd =
        nuisance_sd[static_cast<Index>(group)] > 0 ? *std::max_element(values.begin(), values.end()) : kNone_sd;
    out[static_cast<Index>(i)] = 1 / (sd * sd);
  }
  return out;
}

namespace {

constexpr double kLikely = 1e-4;  // share of a combination of standard deviations, given all recordings
constexpr double kShare = 1e-3;   // and given the others
constexpr double kTogether_s = 1e-9;

// Unknowns: shared, the curves' values, the nuisances' mean if it is one, the recording's own.
struct Belief {
  VectorXd mean;
  MatrixXd precision;
  double log_det = 0;  // of the precision
};

// A positive definite matrix, factored in units of its diagonal: a nuisance that does not vary stands beside others.
struct Factor {
  explicit Factor(const MatrixXd& m)
      : unit(m.diagonal().cwiseSqrt().cwiseInverse()), llt(unit.asDiagonal() * m * unit.asDiagonal()) {}
  VectorXd solve(const VectorXd& v) const { return unit.cwiseProduct(llt.solve(unit.cwiseProduct(v))); }
  double log_det() const { return inference::log_det(llt) - 2 * unit.array().log().sum(); }
  // Diagonal of A M^-1 A'.
  VectorXd variances(const MatrixXd& A) const {
    MatrixXd turned = unit.asDiagonal() * A.transpose();
    llt.matrixL().solveInPlace(turned);
    return turned.colwise().squaredNorm().transpose();
  }
  VectorXd unit;
  Eigen::LLT<MatrixXd> llt;
};

struct Conditioned {
  Belief belief;
  double log_density = 0;
};

Conditioned condition(const Belief& prior, const WhiteReadings& given) {
  Conditioned out;
  out.belief.precision = prior.precision;
  out.belief.precision.noalias() += given.A.transpose() * given.A;
  const Factor factor(out.belief.precision);
  const VectorXd w = given.w - given.A * prior.mean, g = given.A.transpose() * w, step = factor.solve(g);
  out.belief.mean = prior.mean + step;
  out.belief.log_det = factor.log_det();
  const auto n = static_cast<double>(w.size());
  out.log_density = given.log_weights - 0.5 * (w.squaredNorm() - g.dot(step) + out.belief.log_det - prior.log_det +
                                               n * std::log(2 * std::numbers::pi));
  return out;
}

// What the others say of the shared unknowns, at one combination of standard deviations.
struct FromOthers {
  ArrowSolution shared;
  VectorXd own_precision;
  double log_evidence = 0;  // of the others and this combination; one constant for all is left out
  Index spread = 0;         // which combination
};

// recording: past the last, all are others.
std::vector<FromOthers> from_others(LinearModel& model, const CurveColumns& curve, const NuisanceGrid& spreads,
                                    std::size_t recording, double share = kShare) {
  const Fit& fit = *model.fit;
  Pulls pulls = pulls_with_mean(pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance), model.mean);
  ArrowRules rules{.held = fit.held, .covariance_of = std::vector<Index>{}};
  rules.used.assign(model.blocks.size(), true);
  if (recording < model.blocks.size()) rules.used[recording] = false;
  std::vector<FromOthers> out;
  double most = -std::numeric_limits<double>::infinity();
  for (Index k = 0; k < spreads.log_prior.size(); ++k) {
    Scales scales = fit.scales;
    scales.nuisance_sd = spreads.standard_deviations.col(k);
    FromOthers one{.shared = {}, .own_precision = local_precision_of(fit.layout, scales)};
    if (model.mean.size() > 0)
      pulls.precision.diagonal().tail(model.mean.size()) = mean_precision_of(fit.layout.system(), scales.nuisance_sd);
    for (ArrowBlock& block : model.blocks) block.precision = one.own_precision;
    one.shared = solve(model.blocks, pulls.precision, pulls.centre, rules);
    if (!one.shared.valid) continue;
    one.log_evidence = spreads.log_prior[k] - 0.5 * (one.shared.least + one.shared.log_volume_ratio);
    hold_scanned(fit.layout, one.own_precision);
    one.spread = k;
    most = std::max(most, one.log_evidence);
    out.push_back(std::move(one));
  }
  std::erase_if(out, [&](const FromOthers& one) { return one.log_evidence < most + std::log(share); });
  return out;
}

// Steps from a place where the recording's own unknowns have these values; their mean is zero.
Belief belief_of(const FromOthers& others, const VectorXd& own) {
  const Index n = others.shared.shared.size(), all = n + own.size();
  Belief out{.mean = VectorXd(all), .precision = MatrixXd::Zero(all, all)};
  out.mean << others.shared.shared, -own;
  out.precision.topLeftCorner(n, n) = others.shared.information;
  out.precision.diagonal().tail(own.size()) = others.own_precision;
  out.log_det = Factor(others.shared.information).log_det() + others.own_precision.array().log().sum();
  return out;
}

// A mixture's mean and its distribution at zero, row by row.
class Mixed {
 public:
  explicit Mixed(std::vector<Index> rows) {
    forecast_.rows = std::move(rows);
    forecast_.error = forecast_.below = VectorXd::Zero(static_cast<Index>(forecast_.rows.size()));
  }
  // errors: measured less predicted at the unknowns' origin, of all of the recording's rows; A: their derivatives.
  void add(double share, const Belief& belief, const MatrixXd& A, const VectorXd& errors, const VectorXd& noise) {
    const auto& rows = forecast_.rows;
    const MatrixXd part = A(rows, Eigen::all);
    const VectorXd off = errors(rows) - part * belief.mean;
    const VectorXd sd = (Factor(belief.precision).variances(part) + noise(rows)).cwiseSqrt();
    const boost::math::normal normal;
    forecast_.error += share * off;
    for (Index i = 0; i < off.size(); ++i) forecast_.below[i] += share * boost::math::cdf(normal, off[i] / sd[i]);
  }
  Forecast with(double log_density) && {
    forecast_.log_density = log_density;
    return std::move(forecast_);
  }

 private:
  Forecast forecast_;
};

// The recording about a mode: shared unknowns, the curves' values, the nuisances' mean if it is one, its own.
struct Place {
  MatrixXd A;       // whitened
  VectorXd w, own;  // own: its own unknowns there, as steps from their mean
};
std::optional<Place> look(const Fit& fit, const CurveColumns& curve, std::size_t recording, const VectorXd& mean) {
  LinearRecording linear;
  if (!linearise(*fit.likelihood, fit, curve, recording, linear)) return std::nullopt;
  Place out{.A = MatrixXd(linear.Z.rows(), linear.Z.cols() + mean.size() + linear.L.cols()),
            .w = linear.residuals.white,
            .own = -nuisance_centre(fit.layout, fit.local[recording])};
  out.own.head(mean.size()) -= mean;  // nuisances come first
  out.A << linear.Z, linear.L.leftCols(mean.size()), linear.L;
  return out;
}

WhiteReadings part_of(const Place& place, const RecordingRows& rows, const std::vector<Index>& which) {
  return {.A = place.A(which, Eigen::all), .w = place.w(which), .log_weights = rows.log_weights(which)};
}

double log_evidence_of(const std::vector<FromOthers>& others) {
  std::vector<double> logs;
  for (const FromOthers& one : others) logs.push_back(one.log_evidence);
  return log_sum(logs);
}

// All readings and those beyond the first, as of a new recording.
void as_new(const std::vector<FromOthers>& others, const RecordingRows& rows, const Place& place, Forecasts& out) {
  const MatrixXd A = rows.coloured(place.A, false);
  const VectorXd errors = rows.coloured(place.w, false), noise = rows.noise_variances(false);
  const WhiteReadings every = part_of(place, rows, rows.all()), later = rows.rest_alone(A, errors);
  Mixed all(rows.all()), beyond(rows.rest());
  const double total = log_evidence_of(others);
  std::vector<double> log_all, log_beyond;
  for (const FromOthers& one : others) {
    const Belief belief = belief_of(one, place.own);
    const double log_share = one.log_evidence - total;
    all.add(std::exp(log_share), belief, A, errors, noise);
    beyond.add(std::exp(log_share), belief, A, errors, noise);
    log_all.push_back(log_share + condition(belief, every).log_density);
    log_beyond.push_back(log_share + condition(belief, later).log_density);
  }
  out.all = std::move(all).with(log_sum(log_all));
  out.beyond = std::move(beyond).with(log_sum(log_beyond));
}

// The same, given the first readings; returns the logarithm of the evidence of these and the others.
double continued_from(const std::vector<FromOthers>& others, const RecordingRows& rows, const Place& place,
                      Forecast& out) {
  const WhiteReadings every = part_of(place, rows, rows.all()), first = part_of(place, rows, rows.first());
  std::vector<double> log_all, log_first;
  std::vector<Belief> beliefs;
  for (const FromOthers& one : others) {
    const Belief belief = belief_of(one, place.own);
    const Conditioned begun = condition(belief, first);
    log_first.push_back(one.log_evidence + begun.log_density);
    log_all.push_back(one.log_evidence + condition(belief, every).log_density);
    beliefs.push_back(begun.belief);
  }
  const double total = log_sum(log_first);
  const MatrixXd A = rows.coloured(place.A, true);
  const VectorXd errors = rows.coloured(place.w, true), noise = rows.noise_variances(true);
  Mixed continued(rows.rest());
  for (std::size_t k = 0; k < beliefs.size(); ++k)
    continued.add(std::exp(log_first[k] - total), beliefs[k], A, errors, noise);
  out = std::move(continued).with(log_sum(log_all) - total);
  return total;
}

}  // namespace

LinearModel with_mean(LinearModel model, std::size_t recording) {
  const Fit& fit = *model.fit;
  const auto n = static_cast<Index>(fit.layout.system().nuisances().size());
  model.mean = VectorXd::Zero(n);
  double count = 0;
  for (std::size_t r = 0; r < fit.local.size(); ++r)
    if (r != recording) model.mean += fit.local[r].head(n), ++count;
  model.mean /= std::max(count, 1.0);
  for (ArrowBlock& block : model.blocks) {
    const Index shared = block.zz.rows(), all = shared + n;
    MatrixXd zz(all, all), lz(block.ll.rows(), all);
    zz << block.zz, block.lz.topRows(n).transpose(), block.lz.topRows(n), block.ll.topLeftCorner(n, n);
    lz << block.lz, block.ll.leftCols(n);
    VectorXd zw(all);
    zw << block.zw, block.lw.head(n);
    block.zz = std::move(zz), block.lz = std::move(lz), block.zw = std::move(zw);
    block.centre.head(n) += model.mean;
  }
  return model;
}

VectorXd spread_weights(LinearModel model, const CurveColumns& curve, const NuisanceGrid& grid) {
  const std::size_t none = model.blocks.size();
  const auto all = from_others(model, curve, grid, none, 0.1 * kLikely);
  const double total = log_evidence_of(all);
  VectorXd out = VectorXd::Zero(grid.log_prior.size());
  for (const FromOthers& one : all) out[one.spread] = std::exp(one.log_evidence - total);
  return out;
}

double log_evidence_of_others(LinearModel model, const CurveColumns& curve, const NuisanceGrid& spreads,
                              std::size_t recording) {
  return log_evidence_of(from_others(model, curve, spreads, recording));
}

NuisanceGrid likely_part(const NuisanceGrid& grid, const VectorXd& weights) {
  std::vector<Index> columns;
  for (Index k = 0; k < weights.size(); ++k)
    if (weights[k] > kLikely) columns.push_back(k);
  return {.standard_deviations = grid.standard_deviations(Eigen::all, columns), .log_prior = grid.log_prior(columns)};
}

double time_of_share(const SeriesSet& recording, double share) {
  std::vector<double> times;
  for (const Series& series : recording.series) times.insert(times.end(), series.time_s.begin(), series.time_s.end());
  if (times.empty()) return 0;
  const auto count = static_cast<std::size_t>(std::ceil(share * static_cast<double>(times.size())));
  const auto at = times.begin() + static_cast<std::ptrdiff_t>(std::clamp<std::size_t>(count, 1, times.size()) - 1);
  std::nth_element(times.begin(), at, times.end());
  return *at + kTogether_s;
}

namespace {
// log_shares: logarithms of the models' probabilities.
Forecast averaged(const std::vector<Forecasts>& models, Forecast Forecasts::*way,
                  const std::vector<double>& log_shares) {
  const double total = log_sum(log_shares);
  Forecast out = models.front().*way;
  out.error.setZero();
  out.below.setZero();
  std::vector<double> logs;
  for (std::size_t m = 0; m < models.size(); ++m) {
    const Forecast& one = models[m].*way;
    const double share = std::exp(log_shares[m] - total);
    out.error += share * one.error;
    out.below += share * one.below;
    logs.push_back(log_shares[m] - total + one.log_density);
  }
  out.log_density = log_sum(logs);
  return out;
}
}  // namespace

Forecasts averaged(const std::vector<Forecasts>& models, const std::vector<double>& probabilities) {
  std::vector<double> before, after, first;
  double all = 0;
  for (const double probability : probabilities) all += probability;
  for (std::size_t m = 0; m < models.size(); ++m) {
    before.push_back(std::log(probabilities[m] / all));
    after.push_back(before.back() + models[m].log_density_first);
  }
  return {.all = averaged(models, &Forecasts::all, before),
          .beyond = averaged(models, &Forecasts::beyond, before),
          .continued = averaged(models, &Forecasts::continued, after),
          .log_density_first = log_sum(after)};
}

std::optional<Forecasts> forecast(LinearModel others, LinearModel begun, const CurveColumns& curve,
                                  const NuisanceGrid& spreads, std::size_t recording, double until_s) {
  const RecordingRows rows(*others.fit->likelihood, recording, until_s);
  // About its own unknowns' mean.
  Fit mean = *others.fit;
  const auto nuisances = static_cast<Index>(mean.layout.system().nuisances().size());
  mean.local[recording].head(nuisances).setZero();
  mean.local[recording].head(others.mean.size()) += others.mean;
  const auto place = look(mean, curve, recording, others.mean);
  const auto before = from_others(others, curve, spreads, recording);
  if (before.empty() || !place) return std::nullopt;
  Forecasts out;
  as_new(before, rows, *place, out);
  out.log_others = log_evidence_of(before);
  if (rows.first().empty() || rows.rest().empty()) return out;
  const auto there = look(*begun.fit, curve, recording, begun.mean);
  const auto beside = from_others(begun, curve, spreads, recording);
  if (beside.empty() || !there) return std::nullopt;
  out.log_density_first = continued_from(beside, rows, *there, out.continued) - out.log_others;
  return out;
}

}  // namespace bevel::inference
