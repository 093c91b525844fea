// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/own_volume.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostSteps = 4;
constexpr int kHalvings = 4;
constexpr int kToFollow = 3;             // steps of what follows a step; where it needs more, that was too long
constexpr double kSmallStep = 0.02;      // of cost and volume: what a step has to promise
constexpr double kDifference_sd = 0.25;  // of a shared unknown: over which slopes are taken

double log_own_volume(const ArrowBlock& block) {
  return log_det(Eigen::LLT<MatrixXd>(block.own_information())) - block.precision.array().log().sum();
}

bool has_slope(const Unknown& unknown) { return unknown.member < 0 || is_size(*unknown.parameter); }

// Each recording's own unknowns follow a shared one, by the linear model.
std::shared_ptr<const OwnVolume> own_volume_about(const Fit& fit, const CurveColumns& curve,
                                                  const std::vector<ArrowBlock>& blocks,
                                                  const ArrowSolution& solution) {
  const Layout& layout = fit.layout;
  const auto free = free_locals(layout);
  OwnVolume out{.about = fit.shared, .slope = std::vector<VectorXd>(blocks.size(), VectorXd::Zero(fit.shared.size()))};
  parallel_for(blocks.size(), [&](std::size_t r) {
    const double here = log_own_volume(blocks[r]);
    const MatrixXd follow = -Eigen::LLT<MatrixXd>(blocks[r].own_information()).solve(blocks[r].lz);
    for (Index j = 0; j < fit.shared.size(); ++j) {
      const Parameter& p = *layout.shared()[static_cast<std::size_t>(j)].parameter;
      double step = kDifference_sd * std::sqrt(std::max(0.0, solution.covariance(j, j)));
      if (!has_slope(layout.shared()[static_cast<std::size_t>(j)]) || !(step > 0)) continue;
      if (fit.shared[j] + step > p.upper) step = -step;
      Fit there = fit;
      there.own_volume = nullptr;
      there.shared[j] += step;
      for (std::size_t i = 0; i < free.size(); ++i) there.local[r][free[i]] += step * follow(static_cast<Index>(i), j);
      LinearRecording moved;
      if (!linearise(*fit.likelihood, there, curve, r, moved)) continue;
      if (const double slope = 0.5 * (log_own_volume(moved.block) - here) / step; std::isfinite(slope))
        out.slope[r][j] = slope;
    }
  });
  return std::make_shared<const OwnVolume>(std::move(out));
}

// Where no step along them comes to less (instants: no smooth function of the shared unknowns), the slopes are taken
// to the share that keeps the linear model nearest to where it is: none of them at a mode of the cost alone.
std::shared_ptr<const OwnVolume> stationary(OwnVolume volume, const ArrowSolution& without, const ArrowSolution& with) {
  const VectorXd by_slopes = with.shared - without.shared, pulled = without.information * by_slopes;
  const double square = by_slopes.dot(pulled);
  const double share = square > 0 ? std::clamp(-without.shared.dot(pulled) / square, 0.0, 1.0) : 0;
  for (VectorXd& slope : volume.slope) slope *= share;
  return std::make_shared<const OwnVolume>(std::move(volume));
}

}  // namespace

double log_own_volume(const std::vector<ArrowBlock>& blocks) {
  double sum = 0;
  for (const ArrowBlock& block : blocks) sum += log_own_volume(block);
  return sum;
}

Fit with_own_integrated(Fit now, const CurveAt& curve_at) {
  if (!now.valid || free_locals(now.layout).empty()) return now;
  const Likelihood& likelihood = *now.likelihood;
  now.own_volume = nullptr;
  auto curve = curve_at(now, true);
  if (!curve) return now;
  auto blocks = linearise(likelihood, now, *curve);
  if (blocks.empty()) return now;
  double total = now.cost + log_own_volume(blocks);
  std::vector<Index> all(static_cast<std::size_t>(now.shared.size()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Index>(i);
  for (int step = 0;; ++step) {
    const ArrowSolution without = solve_about(now, blocks, *curve);
    if (!without.valid) return now;
    now.own_volume = own_volume_about(now, *curve, blocks, without);
    for (std::size_t r = 0; r < blocks.size(); ++r) blocks[r].slope = now.own_volume->slope[r];
    const ArrowSolution about = solve_about(now, blocks, *curve);
    if (!about.valid || now.cost - about.least < kSmallStep || step == kMostSteps) return now;
    double share = 1;
    bool gained = false;
    for (int halving = 0; halving < kHalvings && !gained; ++halving, share *= 0.5) {
      Fit there = now;
      there.own_volume = nullptr;
      there.shared += share * about.shared.head(now.shared.size());
      there = fit_from(likelihood, std::move(there), curve_at, {.max_iterations = kToFollow, .fixed = all});
      if (!there.valid) continue;
      auto curve_there = curve_at(there, true);
      if (!curve_there) continue;
      auto blocks_there = linearise(likelihood, there, *curve_there);
      if (blocks_there.empty()) continue;
      const double total_there = there.cost + log_own_volume(blocks_there);
      if (!(total_there < total)) continue;
      there.held = now.held;
      now = std::move(there), curve = std::move(curve_there), blocks = std::move(blocks_there), total = total_there;
      gained = true;
    }
    if (!gained) {
      now.own_volume = stationary(*now.own_volume, without, about);
      return now;
    }
  }
}

}  // namespace bevel::inference
