// SPDX-License-Identifier: MIT
#include "proof/bounded_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include <bevel/error.hpp>

namespace bevel::proof {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd step_from(const BoundedProblem& problem, const VectorXd& x, MatrixXd normal, VectorXd gradient,
                   double damping) {
  normal.diagonal() *= 1.0 + damping;
  normal.diagonal().array() += 1e-12 * normal.diagonal().maxCoeff();  // a parameter without effect stays put
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    const bool stays =
        (x(j) <= problem.lowest(j) && gradient(j) > 0) || (x(j) >= problem.highest(j) && gradient(j) < 0);
    if (!stays) continue;
    normal.row(j).setZero();
    normal.col(j).setZero();
    normal(j, j) = 1.0;
    gradient(j) = 0.0;
  }
  return (x - normal.ldlt().solve(gradient)).cwiseMax(problem.lowest).cwiseMin(problem.highest);
}

std::optional<MatrixXd> jacobian_at(const BoundedProblem& problem, const VectorXd& x, const VectorXd& residual) {
  MatrixXd jacobian(residual.size(), x.size());
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    VectorXd moved = x;
    const double probe = x(j) + problem.probe(j) > problem.highest(j) ? -problem.probe(j) : problem.probe(j);
    moved(j) += probe;
    const auto there = problem.residual(moved);
    if (!there) return std::nullopt;
    jacobian.col(j) = (*there - residual) / probe;
  }
  return jacobian;
}

}  // namespace

BoundedFit fit_in_box(const BoundedProblem& problem, const VectorXd& start, int iterations, double hopeless) {
  constexpr int kPatience = 4;
  VectorXd x = start.cwiseMax(problem.lowest).cwiseMin(problem.highest);
  auto residual = problem.residual(x);
  if (!residual) throw DomainError("the refit starts outside the model's domain");
  bool converged = false;
  double damping = 1e-6;
  for (int iteration = 0; iteration < iterations && !converged; ++iteration) {
    if (iteration >= kPatience && residual->norm() > hopeless) break;
    const auto jacobian = jacobian_at(problem, x, *residual);
    if (!jacobian) break;
    const MatrixXd normal = jacobian->transpose() * *jacobian;
    const VectorXd gradient = jacobian->transpose() * *residual;
    const double before = residual->squaredNorm();
    bool better = false;
    for (int attempt = 0; attempt < 12 && !better; ++attempt) {
      const VectorXd moved = step_from(problem, x, normal, gradient, damping);
      auto there = problem.residual(moved);
      better = there && there->squaredNorm() < before;
      if (better) {
        x = moved;
        residual = std::move(there);
      } else {
        damping *= 10.0;
      }
    }
    // A hundredth of a unit of chi-square is nothing to anybody; of a step held short it says nothing.
    converged = !better || (before - residual->squaredNorm() < 1e-2 && damping < 1e-2);
    damping = std::max(damping * 0.03, 1e-9);
  }
  return {x, residual->norm(), converged};
}

}  // namespace bevel::proof
