// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/nuisances.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd local_variances(const ArrowBlock& block, const ArrowSolution& solution) {
  const Eigen::LLT<MatrixXd> factor(block.own_information());
  const MatrixXd through = factor.solve(block.lz);
  const MatrixXd own = factor.solve(MatrixXd::Identity(block.ll.rows(), block.ll.cols()));
  return (own + through * solution.covariance * through.transpose()).diagonal();
}

MatrixXd shared_covariance(const Fit& fit, std::vector<ArrowBlock> blocks, const CurveColumns& curve,
                           const VectorXd& weights) {
  const Index n = fit.shared.size();
  const NuisanceGrid grid = nuisance_grid(fit.layout.system());
  MatrixXd sum = MatrixXd::Zero(n, n);
  double all = 0;
  const double negligible = negligible_of(weights);
  for (Index k = 0; k < weights.size(); ++k) {
    if (weights[k] < negligible) continue;
    const ArrowSolution solution = solve_at(grid.standard_deviations.col(k), fit, blocks, curve);
    if (!solution.valid) continue;
    const VectorXd away = solution.shared.head(n);
    sum += weights[k] * (solution.covariance_with_tails().topLeftCorner(n, n) + away * away.transpose());
    all += weights[k];
  }
  if (all > 0) return sum / all;
  return solve_about(fit, blocks, curve).covariance_with_tails().topLeftCorner(n, n);
}

std::vector<std::vector<Mixture>> nuisance_posterior(const Fit& fit, std::vector<ArrowBlock> blocks,
                                                     const CurveColumns& curve, const VectorXd& weights) {
  const System& system = fit.layout.system();
  const std::size_t count = system.nuisances().size();
  std::vector<std::vector<Mixture>> out(fit.local.size(), std::vector<Mixture>(count));
  const NuisanceGrid grid = nuisance_grid(system);
  const double negligible = negligible_of(weights);
  for (Index k = 0; k < weights.size(); ++k) {
    if (weights[k] < negligible) continue;
    const ArrowSolution solution = solve_at(grid.standard_deviations.col(k), fit, blocks, curve);
    if (!solution.valid) continue;
    for (std::size_t r = 0; r < out.size(); ++r) {
      const VectorXd variances = local_variances(blocks[r], solution);
      // Nuisances come first among a recording's own unknowns.
      for (std::size_t i = 0; i < count; ++i) {
        const auto at = static_cast<Index>(i);
        out[r][i].parts.push_back({.weight = weights[k],
                                   .mean = fit.local[r][at] + solution.local[r][at],
                                   .sd = std::sqrt(std::max(0.0, variances[at]))});
      }
    }
  }
  return out;
}

}  // namespace bevel::inference
