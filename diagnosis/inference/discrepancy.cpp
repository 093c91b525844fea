#include "diagnosis/inference/discrepancy.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

namespace {

// A curve that these recordings cannot show, as a mean square per reading.
constexpr double kInvisible = 1e-14;

// Rows in standard deviations of the noise, its autocorrelation left in.
MatrixXd in_deviations(const Likelihood& likelihood, std::size_t r, MatrixXd rows) {
  Index row = 0;
  const auto& series = likelihood.data().recordings[r].series;
  for (std::size_t c = 0; c < series.size(); ++c)
    for (const double relative : series[c].relative_sd) rows.row(row++) /= likelihood.noise().sigma[c] * relative;
  return rows;
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
  Prediction prediction;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    const MatrixXd raw = likelihood.kept(r, system_->by_curves(r, base.shared.head(n)));
    system_->predict({}, r, base.shared.head(n), base.local[r], true, prediction);
    const MatrixXd C = in_deviations(likelihood, r, raw);
    const MatrixXd J = in_deviations(likelihood, r, likelihood.kept(r, prediction.by_shared));
    JJ += J.transpose() * J;
    JC += J.transpose() * C;
    for (std::size_t k = 0; k < first_.size(); ++k) {
      const auto part = C.middleCols(first_[k], size_[k]);
      CC.block(0, first_[k], size_[k], size_[k]) += part.transpose() * part;
    }
    raw_.push_back(raw.cast<float>());
    white_.push_back(likelihood.whitened(r, raw).cast<float>());
    MatrixXf square = MatrixXf::Zero(largest, columns);
    for (std::size_t k = 0; k < first_.size(); ++k) {
      const auto part = white_.back().middleCols(first_[k], size_[k]);
      square.block(0, first_[k], size_[k], size_[k]).noalias() = part.transpose() * part;
    }
    square_.push_back(std::move(square));
  }
  const auto rows = static_cast<double>(likelihood.data().rows());
  const auto solver = JJ.completeOrthogonalDecomposition();
  for (std::size_t k = 0; k < first_.size(); ++k) {
    const MatrixXd across = JC.middleCols(first_[k], size_[k]);
    visible_.emplace_back((CC.block(0, first_[k], size_[k], size_[k]) - across.transpose() * solver.solve(across)) /
                          rows);
  }
}

MatrixXd Discrepancy::unit_covariance(std::size_t curve, double length) const {
  const MatrixXd correlation = correlation_of(system_->curves()[curve], length);
  const double square = (correlation * visible_[curve]).trace();
  return correlation / std::max(square, kInvisible);
}

CurveColumns Discrepancy::columns(const Likelihood& likelihood, const CurvePrior& prior) const {
  CurveColumns out;
  for (std::size_t r = 0; r < raw_.size(); ++r)
    out.raw.emplace_back(raw_[r].middleCols(first_[prior.curve], size_[prior.curve]).cast<double>()),
        out.columns.push_back(likelihood.whitened(r, out.raw.back()));
  out.covariance = prior.scale * prior.scale * unit_covariance(prior.curve, prior.length);
  return out;
}

double Discrepancy::visible_size(const CurvePrior& prior, const VectorXd& values) const {
  return std::sqrt(std::max(0.0, values.dot(visible_[prior.curve] * values)));
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
      // The columns' own products were made once, for all sets.
      out[k].square += square_[r].block(0, first, size, size).cast<double>() -
                       part.own.middleRows(first, size) * part.by_own.middleRows(first, size).transpose();
    }
  }
  for (std::size_t k = 0; k < first_.size(); ++k) {
    out[k].pull -= across[k] * beside.step();
    out[k].square -= across[k] * beside.covariance() * across[k].transpose();
  }
  return out;
}

std::vector<CurveFactor> Discrepancy::scan(const Marginal& beside) const {
  std::vector<CurveFactor> out;
  if (first_.empty() || !beside.valid()) return out;
  const auto curves = added(beside);
  for (std::size_t k = 0; k < first_.size(); ++k) {
    const auto& [square, pull] = curves[k];
    for (const double length : kCurveLengths) {
      const Eigen::LLT<MatrixXd> root(unit_covariance(k, length));
      const MatrixXd inner = root.matrixU() * square * root.matrixL();
      const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(inner);
      const VectorXd turned = eigen.eigenvectors().transpose() * (root.matrixU() * pull);
      for (const double scale : kCurveScales) {
        double log_factor = 0;
        for (Index i = 0; i < turned.size(); ++i) {
          const double widened = 1 + scale * scale * std::max(0.0, eigen.eigenvalues()[i]);
          log_factor += 0.5 * (scale * scale * turned[i] * turned[i] / widened - std::log(widened));
        }
        out.push_back({{k, scale, length}, log_factor});
      }
    }
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.log_bayes_factor > b.log_bayes_factor; });
  return out;
}

}  // namespace bevel::inference
