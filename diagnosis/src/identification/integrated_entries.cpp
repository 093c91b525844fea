// SPDX-License-Identifier: MIT
// The needle where the entries are integrated out, not fitted: together with the rest they draw it to where a tilt
// moves the readings most and takes up most of the noise. As bevel/diagnosis/inference/own_volume.hpp, in this
// problem's terms.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "identification/trajectory_problem.hpp"

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kMostSteps = 8;
constexpr int kHalvings = 4;
constexpr int kOwnSteps = 2;             // of the entries, after each of the needle's
constexpr double kSmallStep = 0.02;      // of twice the cost and the volume: what a step has to promise
constexpr double kDifference_sd = 0.25;  // of a needle's parameter: over which slopes are taken

double log_det(const MatrixXd& information) { return 2 * information.llt().matrixLLT().diagonal().array().log().sum(); }
}  // namespace

// Of every insertion's own part of the normal equations.
double TrajectoryFit::log_own_volume(const VectorXd& x, const std::vector<Block>& blocks) {
  normal_equations(x, blocks);
  double sum = 0;
  for (Index at = globals_; at < size_; at += locals_) sum += log_det(H_.block(at, at, locals_, locals_));
  return sum;
}

void TrajectoryFit::follow_entries(VectorXd& x, std::vector<Block>& blocks) {
  std::vector<Block> trial;
  for (int step = 0; step < kOwnSteps; ++step) {
    normal_equations(x, blocks);
    VectorXd moved = x;
    for (Index at = globals_; at < size_; at += locals_)
      moved.segment(at, locals_) -= H_.block(at, at, locals_, locals_).llt().solve(g_.segment(at, locals_));
    if (!evaluate(moved, trial) || !(cost(moved, trial) < cost(x, blocks))) return;
    x = moved;
    std::swap(blocks, trial);
  }
}

void TrajectoryFit::integrate_entries(VectorXd& x, std::vector<Block>& now) {
  std::vector<Block> trial;
  double volume = log_own_volume(x, now), total = 2 * cost(x, now) + volume;
  for (int step = 0; step < kMostSteps; ++step) {
    const MatrixXd H = H_;
    VectorXd b = -g_;
    MatrixXd follow(size_ - globals_, globals_);  // entries by the needle
    for (Index at = globals_; at < size_; at += locals_)
      follow.middleRows(at - globals_, locals_) =
          -H.block(at, at, locals_, locals_).llt().solve(MatrixXd(H.block(at, 0, locals_, globals_)));
    const VectorXd sd = H.ldlt().solve(MatrixXd::Identity(size_, size_)).diagonal().cwiseMax(0.0).cwiseSqrt();
    for (Index j = 0; j < globals_; ++j) {
      double by = kDifference_sd * sd(j);
      if (x(j) + by > high_(j)) by = -by;
      VectorXd there = x;
      there(j) += by;
      there.tail(size_ - globals_) += by * follow.col(j);
      if (by != 0 && evaluate(there, trial)) b(j) -= 0.5 * (log_own_volume(there, trial) - volume) / by;
    }
    MatrixXd A = H;
    hold_at_bounds(x, A, b);
    const VectorXd move = A.ldlt().solve(b);
    if (!move.allFinite() || move.dot(b) < kSmallStep) break;
    bool gained = false;
    double share = 1;
    for (int halving = 0; halving < kHalvings && !gained; ++halving, share *= 0.5) {
      VectorXd there = (x + share * move).cwiseMax(low_).cwiseMin(high_);
      if (!evaluate(there, trial)) continue;
      follow_entries(there, trial);
      const double volume_there = log_own_volume(there, trial), total_there = 2 * cost(there, trial) + volume_there;
      if (!(total_there < total)) continue;
      x = there, volume = volume_there, total = total_there;
      std::swap(now, trial);
      gained = true;
    }
    if (!gained) break;
  }
}

}  // namespace bevel::diagnosis
