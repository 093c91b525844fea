// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/marginal.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXf;

namespace {

VectorXf weights_of(const Likelihood& likelihood, const Likelihood& columns_by, std::size_t r) {
  std::vector<float> out;
  for (std::size_t c = 0; c < likelihood.whitening(r).size(); ++c)
    for (std::size_t i = 0; i < likelihood.whitening(r)[c].weight.size(); ++i)
      out.push_back(static_cast<float>(likelihood.whitening(r)[c].weight[i] / columns_by.whitening(r)[c].weight[i]));
  return Eigen::Map<const VectorXf>(out.data(), static_cast<Index>(out.size()));
}

// A square root of a covariance, in units of each unknown's own error; what is held has none.
MatrixXd root_of(const MatrixXd& covariance) {
  const VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const VectorXd inverse = sd.unaryExpr([](double v) { return v > 0 ? 1 / v : 0.0; });
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return sd.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

// Q of L and the root of its prior's precision, one below the other: the rows of L.
MatrixXd orthogonal(const MatrixXd& L, const VectorXd& precision) {
  MatrixXd both(L.rows() + L.cols(), L.cols());
  both.topRows(L.rows()) = L;
  both.bottomRows(L.cols()) = precision.cwiseSqrt().asDiagonal();
  return (Eigen::HouseholderQR<MatrixXd>(both).householderQ() * MatrixXd::Identity(both.rows(), L.cols()))
      .topRows(L.rows());
}

}  // namespace

Marginal::Marginal(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                   const Likelihood* columns_by)
    : set_(fit.layout.set()) {
  std::vector<LinearRecording> recordings;
  const auto blocks = linearise(likelihood, fit, curve, &recordings);
  if (blocks.empty()) return;
  const ArrowSolution solution = solve_about(fit, blocks, curve);
  if (!solution.valid) return;
  valid_ = true;
  step_ = solution.shared;
  root_ = root_of(solution.covariance);
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const MatrixXd &L = recordings[r].L, &Z = recordings[r].Z;
    const MatrixXd Q = orthogonal(L, blocks[r].precision);
    MatrixXf own = Q.cast<float>(), shared = ((Z - Q * (Q.transpose() * Z)) * root_).cast<float>();
    VectorXf left = (recordings[r].residuals.white - L * solution.local[r] - Z * step_).cast<float>();
    if (columns_by != nullptr && columns_by != &likelihood) {
      weight_.push_back(weights_of(likelihood, *columns_by, r));
      own = weight_.back().asDiagonal() * own;
      shared = weight_.back().asDiagonal() * shared;
      left = weight_.back().cwiseProduct(left);
    }
    own_.push_back(std::move(own));
    shared_.push_back(std::move(shared));
    left_.push_back(std::move(left));
  }
}

MatrixXd Marginal::Part::square(const MatrixXf& X, Index first, Index size) const {
  MatrixXf columns = X.middleCols(first, size);
  if (weight != nullptr) columns = weight->asDiagonal() * columns;
  const auto taken = own.middleRows(first, size);
  return (columns.transpose() * columns).cast<double>() - taken * taken.transpose();
}

VectorXd Marginal::Part::squares(const MatrixXf& X) const {
  const MatrixXf weighted = weight != nullptr ? MatrixXf(weight->asDiagonal() * X) : X;
  return weighted.colwise().squaredNorm().transpose().cast<double>() - own.rowwise().squaredNorm();
}

Marginal::Part Marginal::part(std::size_t r, const MatrixXf& X) const {
  Part out{.own = (X.transpose() * own_[r]).cast<double>(),
           .across = (X.transpose() * shared_[r]).cast<double>(),
           .pull = (X.transpose() * left_[r]).cast<double>()};
  if (!weight_.empty()) out.weight = &weight_[r];
  return out;
}

Marginal::Added Marginal::added(const std::vector<MatrixXf>& X) const {
  const Index columns = X.front().cols();
  MatrixXd across = MatrixXd::Zero(columns, step().size());
  Added out{.square = MatrixXd::Zero(columns, columns), .pull = VectorXd::Zero(columns)};
  for (std::size_t r = 0; r < recordings(); ++r) {
    const Part one = part(r, X[r]);
    across += one.across;
    out.pull += one.pull;
    out.square += one.square(X[r], 0, columns);
  }
  out.square -= across * across.transpose();
  return out;
}

}  // namespace bevel::inference
