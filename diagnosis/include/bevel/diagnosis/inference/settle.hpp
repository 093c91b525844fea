// SPDX-License-Identifier: MIT
/// @file
/// Mode of a candidate model at which fit, noise and between-insertion standard deviations agree, with its evidence.
#pragma once
#include <limits>

#include <bevel/diagnosis/inference/discrepancy.hpp>
#include <bevel/diagnosis/inference/nuisance_grid.hpp>

namespace bevel::inference {

/// Natural logs of the evidence over the grid of between-insertion standard deviations.
struct GridEvidence {
  /// At the standard deviations of the fit.
  double log_here = -std::numeric_limits<double>::infinity();
  /// At the best combination of the grid, by the linear model.
  double log_promised = -std::numeric_limits<double>::infinity();
  double log_mean = -std::numeric_limits<double>::infinity();  ///< Averaged over the grid.
  Eigen::VectorXd promised;                                    ///< For each combination, by the linear model.
  Eigen::VectorXd weights;                                     ///< Posterior of each combination.
};

/// Result of settle().
struct Settled {
  Fit fit;            ///< Fit with its likelihood.
  GridEvidence over;  ///< Evidence about the fit.
};

/// Estimates fit, noise (with the uncertain inputs) and between-insertion standard deviations in turn until none
/// changes.
/// @param likelihood Likelihood with the initial noise.
/// @param discrepancy Prepared curves; null if \p scales has no curves.
/// @param layout Layout of the candidate model.
/// @param shared Start values of the shared unknowns.
/// @param local Start values of the local unknowns, per recording.
/// @param scales Initial hyperparameters.
/// @param grid Grid of standard deviations.
/// @param give_up_below Log evidence below which the iteration stops early.
/// @param tangent Curve values about which the model is linear at first; null: zero.
/// @return Fit with its evidence.
Settled settle(const Likelihood& likelihood, const Discrepancy* discrepancy, const Layout& layout,
               Eigen::VectorXd shared, std::vector<Eigen::VectorXd> local, Scales scales, const NuisanceGrid& grid,
               double give_up_below, std::shared_ptr<const CurveTangent> tangent = nullptr);

}  // namespace bevel::inference
