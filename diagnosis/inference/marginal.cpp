#include "diagnosis/inference/marginal.hpp"

#include <Eigen/Cholesky>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

Marginal::Marginal(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve) : set_(fit.layout.set()) {
  const auto free = free_locals(fit.layout);
  const VectorXd precision = local_precision_of(fit.layout, fit.scales);
  const auto own = static_cast<Index>(free.size());
  Residuals residuals;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    if (!likelihood.evaluate(fit.layout, r, fit.shared, fit.local[r], true, residuals)) return;
    if (curve) residuals.white -= curve.columns[r] * fit.curve_values;
    const Index values = curve ? curve.columns[r].cols() : 0;
    MatrixXd Z(residuals.white.size(), fit.shared.size() + values);
    Z.leftCols(fit.shared.size()) = residuals.by_shared;
    if (curve) Z.rightCols(values) = curve.columns[r];
    const MatrixXd L = residuals.by_local(Eigen::all, free);
    ArrowBlock block = make_block(L, Z, residuals.white);
    block.precision = precision;
    block.centre = nuisance_centre(fit.layout, fit.local[r]);
    MatrixXd inner = block.ll;
    inner.diagonal() += precision;
    inner_.emplace_back(inner.llt().solve(MatrixXd::Identity(own, own)));
    pull_.emplace_back(block.lw + precision.cwiseProduct(block.centre));
    MatrixXf LZ(Z.rows(), own + Z.cols());
    LZ.leftCols(own) = L.cast<float>();
    LZ.rightCols(Z.cols()) = Z.cast<float>();
    LZ_.push_back(std::move(LZ));
    w_.emplace_back(residuals.white.cast<float>());
    blocks_.push_back(std::move(block));
  }
  solution_ = solve_about(fit, blocks_, curve);
}

MatrixXd Marginal::Part::square(const MatrixXf& X, Index first, Index size) const {
  const auto columns = X.middleCols(first, size);
  return (columns.transpose() * columns).cast<double>() -
         own.middleRows(first, size) * by_own.middleRows(first, size).transpose();
}

Marginal::Part Marginal::part(std::size_t r, const MatrixXf& X) const {
  const MatrixXd products = (X.transpose() * LZ_[r]).cast<double>();
  const Index count = inner_[r].rows();
  Part out{.own = products.leftCols(count) * inner_[r], .by_own = products.leftCols(count), .across = {}, .pull = {}};
  out.across = products.rightCols(products.cols() - count) - out.own * blocks_[r].lz;
  out.pull = (X.transpose() * w_[r]).cast<double>() - out.own * pull_[r];
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
  out.pull -= across * step();
  out.square -= across * covariance() * across.transpose();
  return out;
}

}  // namespace bevel::inference
