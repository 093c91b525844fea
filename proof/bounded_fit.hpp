// SPDX-License-Identifier: MIT
#pragma once
// Least squares in a box, by finite differences: what the refits of the generator's own integrator need, and no more.
#include <Eigen/Core>
#include <functional>
#include <optional>

namespace bevel::proof {

struct BoundedProblem {
  // Nothing where the model is not defined.
  std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd&)> residual;
  Eigen::VectorXd lowest, highest;
  Eigen::VectorXd probe;  // steps of the differences, > 0
};

struct BoundedFit {
  Eigen::VectorXd point;
  double norm = 0;  // of the residual there
  bool converged = false;
};

// Levenberg and Marquardt; what stands at a bound and wants beyond stays there. Gives up where the norm stays above
// `hopeless` after a few iterations. Throws DomainError if the residual is not defined at `start`.
BoundedFit fit_in_box(const BoundedProblem& problem, const Eigen::VectorXd& start, int iterations, double hopeless);

}  // namespace bevel::proof
