// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/spread_search.hpp>

namespace bevel::inference {

using Eigen::Index;

Index SpreadSearch::next(const Eigen::VectorXd& promised, Index here, double least_gain) const {
  Index best = here;
  double most = promised[here] + least_gain;
  for (Index k = 0; k < promised.size(); ++k)
    if (promised[k] > most && !tried_.contains(k) && apart(system_, k, here) <= reach_) best = k, most = promised[k];
  return best;
}

}  // namespace bevel::inference
