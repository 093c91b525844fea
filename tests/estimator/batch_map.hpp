// SPDX-License-Identifier: MIT
#pragma once
// The batch maximum a posteriori of an insertion without process noise: the best that any filter can do on the data.
// Unknown: the start, 6 of a body-frame error exp(delta) at the entry pose and 3 of the parameters; Ceres.
#include <bevel/estimator/needle_filter.hpp>
#include "tests/estimator/insertion.hpp"

namespace bevel::estimator::testing {

struct BatchMap {
  FilterState state;  // at the newest actuator state, with the covariance of the linearised problem there
  double cost = 0;    // half the sum of squares, prior included
  int iterations = 0;
};
BatchMap solve_batch_map(const EstimatorConfig& config, const Insertion& data);

}  // namespace bevel::estimator::testing
