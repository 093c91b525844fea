// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/likelihood.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

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

}  // namespace bevel::inference
