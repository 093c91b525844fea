// SPDX-License-Identifier: MIT
/// @file
/// Posteriors of the insertion-specific and the shared unknowns about one fit, over the between-insertion standard
/// deviations.
#pragma once
#include <bevel/diagnosis/inference/posterior.hpp>

namespace bevel::inference {

/// Computes the variances of a recording's local unknowns.
/// @param block Normal equations of the recording.
/// @param solution Solution of all recordings, with its full covariance.
/// @return One variance per entry of free_locals().
Eigen::VectorXd local_variances(const ArrowBlock& block, const ArrowSolution& solution);

/// Computes the mean products of the shared unknowns' deviations from the fit.
/// @param fit Fit.
/// @param blocks Normal equations about \p fit.
/// @param curve Columns of the fit's curves.
/// @param weights Posterior over nuisance_grid(), as in Evaluated.
/// @return Square matrix.
Eigen::MatrixXd shared_covariance(const Fit& fit, std::vector<ArrowBlock> blocks, const CurveColumns& curve,
                                  const Eigen::VectorXd& weights);

/// Computes the posteriors of the insertion-specific parameters.
/// @param fit Fit.
/// @param blocks Normal equations about \p fit.
/// @param curve Columns of the fit's curves.
/// @param weights Posterior over nuisance_grid(), as in Evaluated.
/// @return Posteriors, indexed by recording and parameter.
std::vector<std::vector<Mixture>> nuisance_posterior(const Fit& fit, std::vector<ArrowBlock> blocks,
                                                     const CurveColumns& curve, const Eigen::VectorXd& weights);

}  // namespace bevel::inference
