// SPDX-License-Identifier: MIT
#pragma once
// What fit_trajectory() minimises, and its solution: for trajectory_fit.cpp alone.
#include <vector>

#include <bevel/diagnosis/identification/trajectory_fit.hpp>

namespace bevel::diagnosis {

// One insertion's whitened residuals and their Jacobian by the free columns, for one set of parameters.
struct Block {
  Path path;
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;
  bool valid = false;
};

class TrajectoryFit {
 public:
  TrajectoryFit(const std::vector<Insertion>& insertions, const FitOptions& options);
  FitResult run();

 private:
  // x = needle coordinates, then every insertion's free entry coordinates. The coordinate of lambda1 is
  // mu = lambda1 - lambda2^2/(2 pi), so that (26) is mu > 0.
  [[nodiscard]] model::NeedleParameters needle(const Eigen::VectorXd& x) const;
  [[nodiscard]] Entry entry(const Eigen::VectorXd& x, std::size_t insertion) const;
  void set_bounds(const Eigen::VectorXd& x);
  bool evaluate(const Eigen::VectorXd& x, std::vector<Block>& blocks) const;
  void evaluate_one(const Eigen::VectorXd& x, std::size_t i, Block& block) const;
  void renew_scale(const std::vector<Block>& blocks);
  [[nodiscard]] double cost(const Eigen::VectorXd& x, const std::vector<Block>& blocks) const;
  void normal_equations(const Eigen::VectorXd& x, const std::vector<Block>& blocks);
  // Of a step A s = b: what presses against a bound, and what nothing moves, stays.
  void hold_at_bounds(const Eigen::VectorXd& x, Eigen::MatrixXd& A, Eigen::VectorXd& b) const;
  // From the mode of needle and entries together to that of the needle with the entries integrated out, each at its
  // mode there.
  void integrate_entries(Eigen::VectorXd& x, std::vector<Block>& now);
  void follow_entries(Eigen::VectorXd& x, std::vector<Block>& blocks);
  double log_own_volume(const Eigen::VectorXd& x, const std::vector<Block>& blocks);
  [[nodiscard]] std::vector<double> all_residuals(const std::vector<Block>& blocks) const;
  [[nodiscard]] double correlation(const std::vector<Block>& blocks) const;
  FitResult result(const Eigen::VectorXd& x, const std::vector<Block>& blocks) const;

  const std::vector<Insertion>& insertions_;
  const FitOptions& options_;
  std::vector<Parameter> parameters_;  // fitted, by x's first entries
  std::vector<EntryParameter> entry_;  // free entry coordinates of each insertion
  Eigen::Index globals_ = 0, locals_ = 0, size_ = 0;
  int residual_count_ = 0;
  Eigen::VectorXd low_, high_;                 // bounds of x
  Eigen::VectorXd prior_mean_, prior_weight_;  // of the parameters themselves; weight 0: none
  double scale_ = 1;
  double inflation_ = 1;  // of the variance, by correlation in time
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
};

// The parameters that priors speak of: lambda1 itself, not its coordinate mu.
Eigen::VectorXd as_parameters(Eigen::VectorXd x, const std::vector<Parameter>& parameters,
                              const model::NeedleParameters& needle);

}  // namespace bevel::diagnosis
