// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/discrepancy.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

namespace {

// What the base absorbs but for this share of a curve's mean square, these recordings cannot show: it is rounding, of
// columns in single precision.
constexpr double kInvisible = 1e-6;

// For the system's rows in standard deviations of the noise, its autocorrelation left in.
VectorXd one_per_deviation(const Likelihood& likelihood, std::size_t r) {
  const Index rows = likelihood.system().data().recordings[r].rows();
  const VectorXd kept = likelihood.kept(r, VectorXd::LinSpaced(rows, 0, static_cast<double>(rows - 1)));
  VectorXd out = VectorXd::Zero(rows);
  Index next = 0;
  const auto& series = likelihood.data().recordings[r].series;
  for (std::size_t c = 0; c < series.size(); ++c)
    for (const double relative : series[c].relative_sd)
      out[static_cast<Index>(std::lround(kept[next++]))] = 1 / (likelihood.noise().sigma[c] * relative);
  return out;
}

}  // namespace

Discrepancy::Discrepancy(const Likelihood& likelihood, const Fit& base) : system_(&likelihood.system()) {
  Index columns = 0;
  for (const Curve& curve : system_->curves()) {
    first_.push_back(columns);
    size_.push_back(static_cast<Index>(curve.at.size()));
    columns += size_.back();
  }
  const Index largest = size_.empty() ? 0 : *std::max_element(size_.begin(), size_.end());
  // Normal equations of the columns and the base's sensitivities, both in deviations.
  const auto n = static_cast<Index>(system_->base().size());
  MatrixXd JJ = MatrixXd::Zero(n, n), JC = MatrixXd::Zero(n, columns), CC = MatrixXd::Zero(largest, columns);
  const std::size_t recordings = likelihood.recordings();
  per_sd_.resize(recordings), raw_.resize(recordings), white_.resize(recordings), square_.resize(recordings);
  std::vector<MatrixXd> by_curves(recordings), by_base(recordings);
  parallel_for(recordings, [&](std::size_t r) {
    const MatrixXd raw = system_->by_curves(r, base.shared.head(n));
    Prediction prediction;
    system_->predict({}, r, base.shared.head(n), base.local[r], true, prediction);
    per_sd_[r] = one_per_deviation(likelihood, r);
    by_curves[r] = per_sd_[r].asDiagonal() * raw;
    by_base[r] = per_sd_[r].asDiagonal() * prediction.by_shared;
    raw_[r] = raw.cast<float>();
    white_[r] = likelihood.whitened(r, raw).cast<float>();
    square_[r] = MatrixXf::Zero(largest, columns);
    for (std::size_t k = 0; k < first_.size(); ++k) {
      const auto part = white_[r].middleCols(first_[k], size_[k]);
      square_[r].block(0, first_[k], size_[k], size_[k]).noalias() = part.transpose() * part;
    }
  });
  for (std::size_t r = 0; r < recordings; ++r) {
    const MatrixXd &C = by_curves[r], &J = by_base[r];
    JJ += J.transpose() * J;
    JC += J.transpose() * C;
    for (std::size_t k = 0; k < first_.size(); ++k) {
      const auto part = C.middleCols(first_[k], size_[k]);
      CC.block(0, first_[k], size_[k], size_[k]) += part.transpose() * part;
    }
  }
  rows_ = static_cast<double>(likelihood.data().rows());
  absorbed_ = JJ.completeOrthogonalDecomposition().solve(JC);
  absorbing_ = std::move(JC);
  for (std::size_t k = 0; k < first_.size(); ++k) {
    const MatrixXd square = CC.block(0, first_[k], size_[k], size_[k]);
    const MatrixXd absorbed =
        absorbing_.middleCols(first_[k], size_[k]).transpose() * absorbed_.middleCols(first_[k], size_[k]);
    visible_.emplace_back((square - absorbed) / rows_);
    if (!(visible_.back().trace() > kInvisible * square.trace() / rows_)) visible_.back().setZero();
  }
}

MatrixXd Discrepancy::visible_together(std::size_t one, std::size_t other) const {
  if (one == other) return visible_[one];
  MatrixXd out =
      -absorbing_.middleCols(first_[one], size_[one]).transpose() * absorbed_.middleCols(first_[other], size_[other]);
  for (std::size_t r = 0; r < raw_.size(); ++r)
    out += (per_sd_[r].asDiagonal() * raw_[r].middleCols(first_[one], size_[one]).cast<double>()).transpose() *
           (per_sd_[r].asDiagonal() * raw_[r].middleCols(first_[other], size_[other]).cast<double>());
  return out / rows_;
}

MatrixXd Discrepancy::unit_covariance(std::size_t curve, double length) const {
  const MatrixXd correlation = correlation_of(system_->curves()[curve], length);
  // What cannot be seen beside this base, but could beside an earlier one, may have any size.
  return visible_[curve].isZero(0) ? correlation : correlation / (correlation * visible_[curve]).trace();
}

std::vector<Index> Discrepancy::places(std::span<const CurvePrior> curves) const {
  std::vector<Index> out = {0};
  for (const CurvePrior& one : curves) out.push_back(out.back() + size_[one.curve]);
  return out;
}

CurveColumns Discrepancy::columns(const Likelihood& likelihood, std::span<const CurvePrior> curves,
                                  std::shared_ptr<const CurveTangent> tangent) const {
  CurveColumns out;
  if (curves.empty()) return out;
  const auto at = places(curves);
  for (std::size_t r = 0; r < raw_.size(); ++r) {
    MatrixXd raw(raw_[r].rows(), at.back());
    for (std::size_t i = 0; i < curves.size() && !tangent; ++i) {
      const std::size_t k = curves[i].curve;
      raw.middleCols(at[i], size_[k]) = raw_[r].middleCols(first_[k], size_[k]).cast<double>();
    }
    out.raw.push_back(likelihood.kept(r, tangent ? tangent->by_values[r] : raw));
    out.columns.push_back(likelihood.whitened(r, out.raw.back()));
  }
  out.covariance = MatrixXd::Zero(at.back(), at.back());
  for (std::size_t i = 0; i < curves.size(); ++i) set_prior(curves, i, curves[i], out.covariance);
  out.tangent = std::move(tangent);
  return out;
}

void Discrepancy::set_prior(std::span<const CurvePrior> curves, std::size_t which, const CurvePrior& prior,
                            MatrixXd& covariance) const {
  const Index at = places(curves)[which], size = size_[prior.curve];
  covariance.block(at, at, size, size) = prior.scale * prior.scale * unit_covariance(prior.curve, prior.length);
}

double Discrepancy::visible_size(std::size_t curve, const VectorXd& values) const {
  return std::sqrt(std::max(0.0, values.dot(visible_[curve] * values)));
}

double Discrepancy::visible_size(std::span<const CurvePrior> curves, const VectorXd& values) const {
  const auto at = places(curves);
  double square = 0;
  for (std::size_t i = 0; i < curves.size(); ++i)
    for (std::size_t j = 0; j < curves.size(); ++j)
      square += values.segment(at[i], at[i + 1] - at[i])
                    .dot(visible_together(curves[i].curve, curves[j].curve) * values.segment(at[j], at[j + 1] - at[j]));
  return std::sqrt(std::max(0.0, square));
}

std::vector<Marginal::Added> Discrepancy::added(const Marginal& beside) const {
  std::vector<Marginal::Added> out(first_.size());
  std::vector<MatrixXd> across(first_.size());
  for (std::size_t r = 0; r < white_.size(); ++r) {
    const Marginal::Part part = beside.part(r, white_[r]);
    for (std::size_t k = 0; k < first_.size(); ++k) {
      const Index first = first_[k], size = size_[k];
      if (r == 0) {
        out[k] = {.square = MatrixXd::Zero(size, size), .pull = VectorXd::Zero(size)};
        across[k] = MatrixXd::Zero(size, beside.step().size());
      }
      across[k] += part.across.middleRows(first, size);
      out[k].pull += part.pull.segment(first, size);
      // The columns' own products were made once, for all sets in which rows have no weight.
      out[k].square += part.weight != nullptr
                           ? part.square(white_[r], first, size)
                           : square_[r].block(0, first, size, size).cast<double>() -
                                 part.own.middleRows(first, size) * part.own.middleRows(first, size).transpose();
    }
  }
  for (std::size_t k = 0; k < first_.size(); ++k) out[k].square -= across[k] * across[k].transpose();
  return out;
}

std::vector<CurveFactor> Discrepancy::scan(const Marginal& beside) const {
  std::vector<CurveFactor> out;
  if (first_.empty() || !beside.valid()) return out;
  const auto curves = added(beside);
  for (std::size_t k = 0; k < first_.size(); ++k) {
    const auto& [square, pull] = curves[k];
    for (const double length : kCurveLengths) {
      if (visible_[k].isZero(0)) {  // as likely as none
        for (const double scale : kCurveScales) out.push_back({.prior = {k, scale, length}, .visible = {}});
        continue;
      }
      const Eigen::LLT<MatrixXd> root(unit_covariance(k, length));
      const MatrixXd inner = root.matrixU() * square * root.matrixL();
      const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(inner);
      const VectorXd turned = eigen.eigenvectors().transpose() * (root.matrixU() * pull);
      for (const double scale : kCurveScales) {
        CurveFactor one{.prior = {k, scale, length}, .visible = {}};
        for (Index i = 0; i < turned.size(); ++i) {
          const double seen = scale * scale * std::max(0.0, eigen.eigenvalues()[i]);
          const double squared_mean = scale * scale * turned[i] * turned[i] / (1 + seen);
          one.log_bayes_factor += 0.5 * (squared_mean - std::log1p(seen));
          one.visible.add(seen / (1 + seen), squared_mean);
        }
        out.push_back(one);
      }
    }
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.log_bayes_factor > b.log_bayes_factor; });
  return out;
}

}  // namespace bevel::inference
