// SPDX-License-Identifier: MIT
#pragma once
// What each recording has of its own, and what all share, beside one fit, over the standard deviations of the
// nuisances.
#include <bevel/diagnosis/inference/posterior.hpp>

namespace bevel::inference {

// Variances of a recording's own unknowns, in the order of free_locals. solution: with its whole
// covariance.
Eigen::VectorXd local_variances(const ArrowBlock& block, const ArrowSolution& solution);

// Mean squares of how far the shared unknowns are from the fit's, and mean products. blocks: the linear model about the
// fit; weights: over nuisance_grid(), as Evaluated has them.
Eigen::MatrixXd shared_covariance(const Fit& fit, std::vector<ArrowBlock> blocks, const CurveColumns& curve,
                                  const Eigen::VectorXd& weights);

// [recording][nuisance]. blocks: the linear model about the fit; weights: over nuisance_grid(), as Evaluated has them.
std::vector<std::vector<Mixture>> nuisance_posterior(const Fit& fit, std::vector<ArrowBlock> blocks,
                                                     const CurveColumns& curve, const Eigen::VectorXd& weights);

}  // namespace bevel::inference
