#pragma once
// What follows from the sets that were visited: probabilities of sets, of each effect, of a discrepancy; what each
// recording would have been given the others.
#include <map>

#include "diagnosis/inference/search.hpp"

namespace bevel::inference {

struct SetShare {
  ModelSet set;
  double probability = 0;
  double with_discrepancy = 0;  // part of it
};

struct Posterior {
  std::vector<SetShare> sets;               // the likeliest first
  double not_visited = 0;                   // the share of sets that were not fitted, by the linear model's estimate
  std::map<std::string, double> inclusion;  // of each effect by name: the sum over the sets that hold it
  double discrepancy = 0;                   // probability of one whose visible part exceeds the size asked for
  // Names whose inclusion probability exceeds one half.
  std::vector<std::string> named() const;
};

// discrepancy_size: root mean square of its visible part, in standard deviations of the noise; smaller ones are errors
// of form, which widen intervals and are not called missing physics.
Posterior posterior_of(const Search& search, double discrepancy_size);

// log of the predictive density of each recording given the others, constants of 2 pi left out: sets are weighed, and
// their parameters fitted, without the recording, by the linear model about the mode. (Which sets were visited was
// decided with all recordings.)
std::vector<double> held_out_log_density(const Search& search);
// Of one mode alone.
double log_predictive(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                      std::size_t recording);
// The shared parameters that the other recordings give, bounds respected.
Eigen::VectorXd shared_without(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                               std::size_t recording);

}  // namespace bevel::inference
