#include "diagnosis/inference/marginal.hpp"

#include <Eigen/Cholesky>

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

}  // namespace

Marginal::Marginal(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                   const Likelihood* columns_by)
    : set_(fit.layout.set()) {
  LinearRecording recording;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    if (!linearise(likelihood, fit, curve, r, recording)) return;
    const MatrixXd &L = recording.L, &Z = recording.Z;
    const ArrowBlock& block = recording.block;
    inner_.emplace_back(block.own_information().llt().solve(MatrixXd::Identity(L.cols(), L.cols())));
    pull_.emplace_back(block.lw + block.precision.cwiseProduct(block.centre));
    MatrixXf LZ(Z.rows(), L.cols() + Z.cols());
    LZ.leftCols(L.cols()) = L.cast<float>();
    LZ.rightCols(Z.cols()) = Z.cast<float>();
    VectorXf white = recording.residuals.white.cast<float>();
    if (columns_by != nullptr && columns_by != &likelihood) {
      weight_.push_back(weights_of(likelihood, *columns_by, r));
      LZ = weight_.back().asDiagonal() * LZ;
      white = weight_.back().cwiseProduct(white);
    }
    LZ_.push_back(std::move(LZ));
    w_.push_back(std::move(white));
    blocks_.push_back(block);
  }
  solution_ = solve_about(fit, blocks_, curve);
}

MatrixXd Marginal::Part::square(const MatrixXf& X, Index first, Index size) const {
  MatrixXf columns = X.middleCols(first, size);
  if (weight != nullptr) columns = weight->asDiagonal() * columns;
  return (columns.transpose() * columns).cast<double>() -
         own.middleRows(first, size) * by_own.middleRows(first, size).transpose();
}

VectorXd Marginal::Part::squares(const MatrixXf& X) const {
  const MatrixXf weighted = weight != nullptr ? MatrixXf(weight->asDiagonal() * X) : X;
  return weighted.colwise().squaredNorm().transpose().cast<double>() - own.cwiseProduct(by_own).rowwise().sum();
}

Marginal::Part Marginal::part(std::size_t r, const MatrixXf& X) const {
  const MatrixXd products = (X.transpose() * LZ_[r]).cast<double>();
  const Index count = inner_[r].rows();
  Part out{.own = products.leftCols(count) * inner_[r], .by_own = products.leftCols(count), .across = {}, .pull = {}};
  if (!weight_.empty()) out.weight = &weight_[r];
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
