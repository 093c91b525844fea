// SPDX-License-Identifier: MIT
#pragma once
// What the generator draws an effect's sizes from, as a density (docs/proof/distribution.md): half of them as the field
// reports them, uniform over a range; half scaled by a factor, of at most 1.5, so that a number of standard deviations
// that is log-uniform can be seen.
#include <bevel/diagnosis/inference/likelihood.hpp>
#include "tests/ceiling/generator_system.hpp"

namespace bevel::ceiling {

class SizePrior {
 public:
  // ranges: of the effect's sizes. Of an effect on no list other numbers of deviations are drawn. least_factor: of a
  // kind, below which nothing is scaled.
  SizePrior(std::vector<proof::ParameterRange> ranges, bool listed, double least_factor);
  // from_neutral: sizes' distances from neutral; visible_sigmas: what of them can be seen.
  double density(const Eigen::VectorXd& from_neutral, double visible_sigmas) const;

 private:
  double natural(const Eigen::VectorXd& from_neutral) const;
  std::vector<proof::ParameterRange> ranges_;
  double low_sigmas_, high_sigmas_, least_factor_;
};

// Which effect of a set, and how many standard deviations one of its sizes shows at a distance of one unit from
// neutral, where only that one departs.
struct Visible {
  Eigen::VectorXd sigmas_per_unit;  // in the order of the effect's sizes
};

// Of a set, as Search::log_prior: log_prior_odds for each effect, of an effect on a list shared by its kinds. On no
// list each is an effect of its own.
double log_prior_of(const GeneratorSystem& system, const inference::ModelSet& set, double log_prior_odds);

// Logarithm of the generator's prior over the flat ones of GeneratorSystem, averaged over the posterior about a fit by
// those: sizes by their densities, instants by the generator's chance of one in a recording, and its time of it.
double log_prior_ratio(const GeneratorSystem& system, const inference::Fit& fit, const std::vector<Visible>& visible);

}  // namespace bevel::ceiling
