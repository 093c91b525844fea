#include "diagnosis/inference/likelihood.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "diagnosis/parallel.hpp"

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd correlation_of(const Curve& curve, double length) {
  const auto n = static_cast<Index>(curve.at.size());
  const double range = curve.periodic ? 2 * std::numbers::pi : curve.at.back() - curve.at.front();
  MatrixXd out(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      double apart = std::abs(curve.at[static_cast<std::size_t>(i)] - curve.at[static_cast<std::size_t>(j)]) / range;
      if (curve.periodic) apart = std::min(apart, 1 - apart);
      out(i, j) = std::exp(-apart / length);
    }
  return out;
}

Likelihood::Likelihood(const System& system, const Readings& outliers, Noise noise, const std::vector<VectorXd>& inputs)
    : system_(&system),
      memo_(std::make_shared<PredictionMemo>(system)),
      outliers_(outliers),
      data_(without(system.data(), outliers)),
      rows_(rows_left(system.data(), outliers)) {
  for (const SeriesSet& recording : data_.recordings) {
    VectorXd measured(recording.rows());
    Index row = 0;
    for (const Series& series : recording.series)
      for (const double value : series.measured) measured[row++] = value;
    measured_.push_back(std::move(measured));
  }
  set_noise(std::move(noise), inputs);
}

Likelihood::Likelihood(const Likelihood& other, Noise noise, const std::vector<VectorXd>& inputs) : Likelihood(other) {
  set_noise(std::move(noise), inputs);
}

Likelihood::Likelihood(const Likelihood& other, Noise noise, const std::vector<VectorXd>& inputs,
                       const ByReading& precision)
    : Likelihood(other) {
  for (std::size_t r = 0; r < data_.recordings.size(); ++r)
    for (std::size_t c = 0; c < data_.recordings[r].series.size(); ++c)
      data_.recordings[r].series[c].precision = precision.empty() ? std::vector<double>{} : precision[r][c];
  set_noise(std::move(noise), inputs);
}

void Likelihood::set_noise(Noise noise, const std::vector<VectorXd>& inputs) {
  for (std::size_t r = 0; r < data_.recordings.size(); ++r) {
    auto& series = data_.recordings[r].series;
    for (Series& one : series) one.input_sd.clear();
    if (inputs.empty()) continue;
    const auto own = by_channel(data_.recordings[r], kept(r, inputs[r]));
    for (std::size_t c = 0; c < series.size(); ++c)
      for (const double sd : own[c]) series[c].input_sd.push_back(sd / noise.sigma[c]);
  }
  noise_ = std::move(noise);
  information_ = 1;
  log_weights_ = VectorXd::Zero(static_cast<Index>(data_.recordings.size()));
  whitening_.assign(data_.recordings.size(), {});
  for (std::size_t r = 0; r < data_.recordings.size(); ++r)
    for (std::size_t c = 0; c < data_.recordings[r].series.size(); ++c) {
      whitening_[r].push_back(make_whitening(data_.recordings[r].series[c], noise_.of(c), noise_.sigma[c]));
      double& sum = log_weights_[static_cast<Index>(r)];
      for (const double weight : whitening_[r].back().weight) sum += std::log(weight);
      for (const double precision : data_.recordings[r].series[c].precision) {
        sum += log_density_beyond(precision, noise_.tails);
        information_ = information_of(noise_.tails);
      }
    }
}

void Likelihood::whiten_rows(std::size_t r, Eigen::Ref<MatrixXd> rows) const {
  Index row = 0;
  for (const Whitening& whitening : whitening_[r]) {
    const auto count = static_cast<Index>(whitening.weight.size());
    whiten(whitening, rows.middleRows(row, count));
    row += count;
  }
}

MatrixXd Likelihood::kept(std::size_t r, const MatrixXd& columns) const {
  if (static_cast<std::size_t>(columns.rows()) == rows_[r].size()) return columns;
  return columns(rows_[r], Eigen::all);
}

MatrixXd Likelihood::whitened(std::size_t r, const MatrixXd& columns) const {
  MatrixXd out = kept(r, columns);
  whiten_rows(r, out);
  return out;
}

VectorXd Likelihood::errors(const Layout& layout, std::size_t r, const VectorXd& shared, const VectorXd& local,
                            const CurveColumns& curve, const VectorXd& curve_values) const {
  const auto prediction = memo_->predict(layout.set(), r, shared, local, false, curve.tangent);
  if (!prediction) return {};
  VectorXd out = measured_[r] - kept(r, prediction->reading);
  if (curve) out -= curve.raw[r] * curve.steps_to(curve_values);
  return out;
}

bool Likelihood::evaluate(const Layout& layout, std::size_t r, const VectorXd& shared, const VectorXd& local,
                          bool derivatives, Residuals& out, const CurveColumns& curve,
                          const VectorXd& curve_values) const {
  const auto prediction = memo_->predict(layout.set(), r, shared, local, derivatives, curve.tangent);
  if (!prediction) return false;
  MatrixXd white = measured_[r] - kept(r, prediction->reading);
  whiten_rows(r, white);
  out.white = white;
  if (curve) out.white -= curve.columns[r] * curve.steps_to(curve_values);
  if (derivatives) {
    out.by_shared = whitened(r, prediction->by_shared);
    out.by_local = whitened(r, prediction->by_local);
  }
  return out.white.allFinite();
}

std::vector<Index> free_locals(const Layout& layout) {
  std::vector<Index> out;
  for (std::size_t i = 0; i < layout.local().size(); ++i)
    if (layout.is_fitted(i)) out.push_back(static_cast<Index>(i));
  return out;
}

VectorXd nuisance_centre(const Layout& layout, const VectorXd& local) {
  const auto free = free_locals(layout);
  VectorXd out = VectorXd::Zero(static_cast<Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i)
    if (!layout.is_scanned(static_cast<std::size_t>(free[i]))) out[static_cast<Index>(i)] = -local[free[i]];
  return out;
}

Pulls pulls_of(const Layout& layout, const VectorXd& shared, const VectorXd& curve_values,
               const MatrixXd& curve_covariance) {
  Pulls out;
  const Index n = shared.size(), m = curve_values.size();
  out.precision = MatrixXd::Zero(n + m, n + m);
  out.centre = VectorXd::Zero(n + m);
  for (Index i = 0; i < n; ++i) {
    const Prior& prior = layout.shared()[static_cast<std::size_t>(i)].parameter->prior;
    out.precision(i, i) = precision_of(prior);
    out.centre[i] = centre_of(prior, shared[i]) - shared[i];
  }
  if (m > 0) {
    out.precision.bottomRightCorner(m, m) = curve_covariance.inverse();
    out.centre.tail(m) = -curve_values;
  }
  return out;
}

void hold_scanned(const Layout& layout, VectorXd& precision) {
  constexpr double kHeld = 1e18;
  const auto free = free_locals(layout);
  for (std::size_t i = 0; i < free.size(); ++i)
    if (layout.is_scanned(static_cast<std::size_t>(free[i]))) precision[static_cast<Index>(i)] = kHeld;
}

VectorXd local_precision_of(const Layout& layout, const Scales& scales) {
  const auto free = free_locals(layout);
  VectorXd out(static_cast<Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = static_cast<std::size_t>(free[i]);
    double& precision = out[static_cast<Index>(i)];
    if (layout.is_scanned(at)) {
      precision = precision_of(layout.local()[at].parameter->prior);
    } else {
      const auto group = layout.system().nuisances()[at].group;
      const double sd = std::max(scales.nuisance_sd[static_cast<Index>(group)], kNone_sd);
      precision = 1 / (sd * sd);
    }
  }
  return out;
}

bool linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve, std::size_t r,
               LinearRecording& out) {
  Residuals& residuals = out.residuals;
  if (!likelihood.evaluate(fit.layout, r, fit.shared, fit.local[r], true, residuals, curve, fit.curve_values))
    return false;
  out.Z = residuals.by_shared;
  if (curve) {
    out.Z.conservativeResize(Eigen::NoChange, out.Z.cols() + curve.columns[r].cols());
    out.Z.rightCols(curve.columns[r].cols()) = curve.columns[r];
  }
  const auto free = free_locals(fit.layout);
  out.L = residuals.by_local(Eigen::all, free);
  // What did not happen has no derivative by when it did.
  for (std::size_t i = 0; i < free.size(); ++i)
    if (fit.layout.is_instant(static_cast<std::size_t>(free[i])) && fit.local[r][free[i]] == 0)
      out.L.col(static_cast<Index>(i)).setZero();
  out.block = make_block(out.L, out.Z, residuals.white);
  out.block.precision = local_precision_of(fit.layout, fit.scales);
  out.block.centre = nuisance_centre(fit.layout, fit.local[r]);
  if (fit.own_volume) out.block.slope = fit.own_volume->slope[r];
  return true;
}

namespace {

bool make_blocks(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                 std::vector<ArrowBlock>& blocks) {
  blocks.resize(likelihood.recordings());
  std::atomic<bool> valid = true;
  parallel_for(likelihood.recordings(), [&](std::size_t r) {
    LinearRecording recording;
    if (!valid) return;
    if (linearise(likelihood, fit, curve, r, recording))
      blocks[r] = std::move(recording.block);
    else
      valid = false;
  });
  return valid;
}

// Squared residuals and the priors' pulls.
double cost_of(const Pulls& pulls, const std::vector<ArrowBlock>& blocks) {
  double cost = pulls.centre.dot(pulls.precision * pulls.centre);
  for (const ArrowBlock& block : blocks)
    cost += block.ww + block.centre.dot(block.precision.cwiseProduct(block.centre));
  return cost;
}

// What presses against a bound stays there, as what is fixed does.
ArrowSolution solve_within(const Fit& now, const std::vector<ArrowBlock>& blocks, const Pulls& pulls, ArrowRules& how,
                           const std::vector<Index>& fixed = {}) {
  how.held = fixed;
  ArrowSolution step = solve(blocks, pulls.precision, pulls.centre, how);
  for (int pass = 0; step.valid && pass < 3; ++pass) {
    const auto before = how.held.size();
    for (Index i = 0; i < now.shared.size(); ++i) {
      const Parameter& p = *now.layout.shared()[static_cast<std::size_t>(i)].parameter;
      const bool outwards = !p.periodic && ((now.shared[i] <= p.lower && step.shared[i] < 0) ||
                                            (now.shared[i] >= p.upper && step.shared[i] > 0));
      if (outwards && std::ranges::count(fixed, i) == 0) how.held.push_back(i);
    }
    if (how.held.size() == before) break;
    step = solve(blocks, pulls.precision, pulls.centre, how);
  }
  return step;
}

}  // namespace

ArrowSolution solve_about(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                          std::optional<std::vector<Index>> covariance_of) {
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance);
  ArrowRules how{.covariance_of = std::move(covariance_of)};
  return solve_within(fit, blocks, pulls, how);
}

ArrowSolution solve_at(const VectorXd& nuisance_sd, const Fit& fit, std::vector<ArrowBlock>& blocks,
                       const CurveColumns& curve, std::optional<std::vector<Index>> covariance_of) {
  const VectorXd precision = local_precision_of(fit.layout, {.nuisance_sd = nuisance_sd, .curves = {}});
  for (ArrowBlock& block : blocks) block.precision = precision;
  return solve_about(fit, blocks, curve, std::move(covariance_of));
}

Fit carried_to(Layout layout, const Fit& from) {
  Fit out(std::move(layout));
  out.scales = from.scales;
  out.shared = out.layout.shared_from(from.layout, from.shared);
  for (const VectorXd& local : from.local) out.local.push_back(out.layout.local_from(from.layout, local));
  out.curve_values = from.curve_values;
  out.tangent = from.tangent;
  out.likelihood = from.likelihood;
  out.valid = from.valid;
  return out;
}

std::vector<VectorXd> inputs_about(const Fit& fit) {
  std::vector<VectorXd> out;
  const Likelihood& likelihood = *fit.likelihood;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    out.push_back(likelihood.system().by_inputs(fit.layout.set(), r, fit.shared, fit.local[r]));
    if (out.back().size() == 0) return {};
  }
  return out;
}

std::shared_ptr<const Likelihood> with_inputs_of(const Fit& fit, const std::shared_ptr<const Likelihood>& likelihood) {
  const auto inputs = inputs_about(fit);
  return inputs.empty() ? likelihood : std::make_shared<const Likelihood>(*likelihood, likelihood->noise(), inputs);
}

std::vector<ArrowBlock> linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve) {
  std::vector<ArrowBlock> blocks;
  if (!make_blocks(likelihood, fit, curve, blocks)) blocks.clear();
  return blocks;
}

double cost_at(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve) {
  const Pulls pulls = pulls_of(fit.layout, fit.shared, fit.curve_values, curve.covariance);
  const VectorXd precision = local_precision_of(fit.layout, fit.scales);
  std::vector<double> squares(likelihood.recordings());
  parallel_for(likelihood.recordings(), [&](std::size_t r) {
    Residuals residuals;
    squares[r] = likelihood.evaluate(fit.layout, r, fit.shared, fit.local[r], false, residuals, curve, fit.curve_values)
                     ? residuals.white.squaredNorm()
                     : std::numeric_limits<double>::infinity();
  });
  double cost = pulls.centre.dot(pulls.precision * pulls.centre);
  for (std::size_t r = 0; r < squares.size(); ++r) {
    const VectorXd centre = nuisance_centre(fit.layout, fit.local[r]);
    cost += squares[r] + centre.dot(precision.cwiseProduct(centre));
  }
  return cost;
}

Fit fit(const Likelihood& likelihood, const Layout& layout, const VectorXd& shared, const std::vector<VectorXd>& local,
        const Scales& scales, const CurveColumns& curve, const FitRules& rules) {
  Fit begin(layout);
  begin.scales = scales;
  begin.shared = shared;
  begin.local = local;
  begin.own_volume = rules.own_volume;
  if (curve) begin.curve_values = curve.tangent ? curve.tangent->values : VectorXd::Zero(curve.covariance.rows());
  const std::shared_ptr<const CurveColumns> same(std::shared_ptr<const void>(), &curve);  // not owned
  return fit_from(
      likelihood, std::move(begin), [&](const Fit&) { return same; }, rules);
}

Fit fit_from(const Likelihood& likelihood, Fit now, const CurveAt& curve_at, const FitRules& rules) {
  const Layout layout = now.layout;
  layout.clamp(now.shared, now.local);
  const auto free = free_locals(layout);
  // Derivatives come with the cost: most steps are taken.
  struct Point {
    std::shared_ptr<const CurveColumns> curve;
    std::vector<ArrowBlock> blocks;
    Pulls pulls;
  };
  const auto look = [&](Fit& at, Point& point) {
    at.cost = std::numeric_limits<double>::infinity();
    point.curve = curve_at(at);
    if (!point.curve || !make_blocks(likelihood, at, *point.curve, point.blocks)) return;
    at.tangent = point.curve->tangent;
    point.pulls = pulls_of(layout, at.shared, at.curve_values, point.curve->covariance);
    at.cost = cost_of(point.pulls, point.blocks);
  };
  Point here, there;
  look(now, here);
  now.valid = std::isfinite(now.cost);
  // With what the recordings' own volume is more, or less, than where its slopes were taken.
  VectorXd slope = VectorXd::Zero(now.shared.size());
  if (now.own_volume)
    for (const VectorXd& one : now.own_volume->slope) slope += one;
  const auto with_volume = [&](const Fit& at, double cost) {
    return now.own_volume ? cost + 2 * slope.dot(at.shared - now.own_volume->about) : cost;
  };
  double damping = 1e-4;
  for (int iteration = 0; now.valid && iteration < rules.max_iterations; ++iteration) {
    now.iterations = iteration + 1;
    ArrowRules how{.damping = damping, .covariance_of = std::vector<Index>{}};
    bool moved = false, small = false;
    while (how.damping < 1e8) {
      const ArrowSolution step = solve_within(now, here.blocks, here.pulls, how, rules.fixed);
      if (!step.valid) {
        how.damping = std::max(how.damping * 6, 1e-6);
        continue;
      }
      // What the linear model expects to gain is too little to look for.
      const double least = with_volume(now, step.least), here_is = with_volume(now, now.cost);
      if (here_is - least < rules.tolerance && how.damping < 1e-2) {
        now.held = how.held;
        break;
      }
      Fit trial = now;
      trial.shared += step.shared.head(now.shared.size());
      trial.curve_values += step.shared.tail(now.curve_values.size());
      for (std::size_t r = 0; r < trial.local.size(); ++r)
        if (step.local[r].size() > 0)
          for (std::size_t i = 0; i < free.size(); ++i) trial.local[r][free[i]] += step.local[r][static_cast<Index>(i)];
      layout.clamp(trial.shared, trial.local);
      look(trial, there);
      if (const double gained = here_is - with_volume(trial, trial.cost); gained > 0) {
        trial.held = how.held;
        small = gained < rules.tolerance;
        now = std::move(trial);
        std::swap(here, there);
        damping = std::max(how.damping * 0.2, 1e-7);
        moved = true;
        break;
      }
      how.damping *= 6;
    }
    if (!moved || small) break;
  }
  return now;
}

}  // namespace bevel::inference
