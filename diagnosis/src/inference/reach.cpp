// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/inference/proposals.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

Reach Proposals::reach(const Marginal& base) const {
  Reach out;
  std::vector<Side> sides;
  for (std::size_t e = 0; e < candidates_.size(); ++e)
    if (!candidates_[e].signatures.empty() && !contains(base.set(), e))
      sides.push_back({.effect = e, .signature = (candidates_[e].signatures.size() - 1) / 2});
  if (sides.empty() || !base.valid()) return out;
  const auto X = side_by_side(sides);
  const Marginal::Added all = base.added(X);
  VectorXd whole = VectorXd::Zero(all.pull.size());
  for (const MatrixXf& one : X) whole += one.colwise().squaredNorm().transpose().cast<double>();
  for (const Side& side : sides) {
    const Candidate& candidate = candidates_[side.effect];
    out.effects.push_back(side.effect);
    for (std::size_t a = 0; a < candidate.amplitudes.size(); ++a) {
      const Parameter& p = system_->effects()[side.effect].parameters[candidate.amplitudes[a]];
      const Index column = side.first + std::min(static_cast<Index>(a), side.width - 1);
      const double visible = std::max(0.0, all.square(column, column));
      const double unit =
          std::abs(candidate.signatures[side.signature].values[static_cast<Index>(candidate.amplitudes[a])] - p.none);
      out.sizes.push_back({.effect = side.effect,
                           .parameter = candidate.amplitudes[a],
                           .one_deviation = unit / std::sqrt(visible),
                           .typical = unit,
                           .absorbed = whole[column] > 0 ? 1 - visible / whole[column] : 1});
    }
  }
  // Cosines between the visible parts: of effects with several columns the largest between their planes.
  const auto n = static_cast<Index>(sides.size());
  out.cosine = MatrixXd::Identity(n, n);
  const auto root_of = [&](const Side& side) -> MatrixXd {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        all.square.block(side.first, side.first, side.width, side.width));
    const VectorXd& values = eigen.eigenvalues();
    const double least = 1e-6 * std::max(values.maxCoeff(), 1e-12);
    return eigen.eigenvectors() *
           values.unaryExpr([&](double v) { return v > least ? 1 / std::sqrt(v) : 0.0; }).asDiagonal();
  };
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < i; ++j) {
      const Side &a = sides[static_cast<std::size_t>(i)], &b = sides[static_cast<std::size_t>(j)];
      const MatrixXd product =
          root_of(a).transpose() * all.square.block(a.first, b.first, a.width, b.width) * root_of(b);
      out.cosine(i, j) = out.cosine(j, i) = std::min(1.0, Eigen::JacobiSVD<MatrixXd>(product).singularValues()[0]);
    }
  return out;
}

}  // namespace bevel::inference
