// SPDX-License-Identifier: MIT
#pragma once
// Which standard deviations of the nuisances a fit is made with next. The linear model about a fit says what each
// combination promises; where it was wrong so many steps of the grid away, it is asked for half as many: a trust region
// (Conn, Gould and Toint 2000, Trust-Region Methods, 6.1), on a grid.
#include <set>

#include <bevel/diagnosis/inference/nuisance_grid.hpp>

namespace bevel::inference {

// Combinations are columns of nuisance_grid().
class SpreadSearch {
 public:
  explicit SpreadSearch(const System& system) : system_(system) {}

  void tried(Eigen::Index spread) { tried_.insert(spread); }
  // A fit there is less likely than at the best known, though more was promised.
  void lost(Eigen::Index spread, Eigen::Index best) { reach_ = apart(system_, spread, best) / 2; }
  // A fit was likelier than the best known, as promised.
  void gained() { reach_ *= 2; }
  // That which promises most, and more than `here` by least_gain, of those within reach where no fit was made; `here`:
  // none does. promised: a logarithm each.
  Eigen::Index next(const Eigen::VectorXd& promised, Eigen::Index here, double least_gain) const;

 private:
  const System& system_;
  std::set<Eigen::Index> tried_;
  Eigen::Index reach_ = 64;  // steps of the grid: farther than any two are apart
};

}  // namespace bevel::inference
