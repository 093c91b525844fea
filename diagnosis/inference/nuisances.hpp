#pragma once
// What each recording has of its own: the posterior of its nuisances beside one fit, over their standard deviations.
#include "diagnosis/inference/posterior.hpp"

namespace bevel::inference {

// Variances of a recording's own unknowns, in the order of free_locals. solution: with its whole
// covariance.
Eigen::VectorXd local_variances(const ArrowBlock& block, const ArrowSolution& solution);

// [recording][nuisance]. blocks: the linear model about the fit; weights: over nuisance_grid(), as Evaluated has them.
std::vector<std::vector<Mixture>> nuisance_posterior(const Fit& fit, std::vector<ArrowBlock> blocks,
                                                     const CurveColumns& curve, const Eigen::VectorXd& weights);

}  // namespace bevel::inference
