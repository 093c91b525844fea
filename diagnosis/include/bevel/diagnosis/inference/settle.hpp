// SPDX-License-Identifier: MIT
#pragma once
// The mode of a set where fit, noise and the nuisances' standard deviations agree, with the evidence about it.
#include <limits>

#include <bevel/diagnosis/inference/discrepancy.hpp>
#include <bevel/diagnosis/inference/nuisance_grid.hpp>

namespace bevel::inference {

// Logarithms of the evidence over the grid of the nuisances' standard deviations.
struct GridEvidence {
  double log_here = -std::numeric_limits<double>::infinity();      // at the standard deviations of the fit
  double log_promised = -std::numeric_limits<double>::infinity();  // at the best of the grid, by the linear model
  double log_mean = -std::numeric_limits<double>::infinity();      // over the grid
  Eigen::VectorXd promised;                                        // of each combination, by the linear model
  Eigen::VectorXd weights;
};

struct Settled {
  Fit fit;
  GridEvidence over;
};

// Fit, noise (with what the inputs leave open) and the nuisances' standard deviations in turn, until none changes. From
// the starting values and scales; likelihood: where the noise begins; discrepancy: null where the scales have no
// curves; tangent: what they are linear about at first. Once the evidence is below give_up_below, it is left as it is.
Settled settle(const Likelihood& likelihood, const Discrepancy* discrepancy, const Layout& layout,
               Eigen::VectorXd shared, std::vector<Eigen::VectorXd> local, Scales scales, const NuisanceGrid& grid,
               double give_up_below, std::shared_ptr<const CurveTangent> tangent = nullptr);

}  // namespace bevel::inference
