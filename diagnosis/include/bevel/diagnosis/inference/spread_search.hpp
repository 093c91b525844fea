// SPDX-License-Identifier: MIT
/// @file
/// Choice of the between-insertion standard deviations for the next fit. The linear model predicts the evidence of each
/// combination. After a wrong prediction the search halves its range: a trust region (Conn, Gould and Toint 2000,
/// Trust-Region Methods, 6.1) on a grid.
#pragma once
#include <set>

#include <bevel/diagnosis/inference/nuisance_grid.hpp>

namespace bevel::inference {

/// Trust region over the columns of nuisance_grid().
class SpreadSearch {
 public:
  /// Starts a search over the whole grid.
  /// @param system Model; must outlive this object.
  explicit SpreadSearch(const System& system) : system_(system) {}

  /// Records that a fit was made.
  /// @param spread Column of the grid.
  void tried(Eigen::Index spread) { tried_.insert(spread); }
  /// Records that a fit is less likely than the best one, contrary to the prediction. The range becomes half their
  /// distance.
  /// @param spread Column of the fit.
  /// @param best Column of the best fit.
  void lost(Eigen::Index spread, Eigen::Index best) { reach_ = apart(system_, spread, best) / 2; }
  /// Records that a fit is more likely than the best one, as predicted. The range doubles.
  void gained() { reach_ *= 2; }
  /// Chooses the combination with the largest prediction within the range for which no fit was made.
  /// @param promised Predicted log evidence of each column.
  /// @param here Column of the current fit.
  /// @param least_gain Smallest predicted gain in log evidence.
  /// @return Column; \p here if none gains enough.
  Eigen::Index next(const Eigen::VectorXd& promised, Eigen::Index here, double least_gain) const;

 private:
  const System& system_;
  std::set<Eigen::Index> tried_;
  Eigen::Index reach_ = 64;  // steps of the grid: farther than any two are apart
};

}  // namespace bevel::inference
