// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/identification/trajectory_fit.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <bevel/diagnosis/identification/fit_statistics.hpp>
#include <bevel/error.hpp>
#include "identification/trajectory_problem.hpp"

namespace bevel::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

FitResult TrajectoryFit::run() {
  VectorXd x = VectorXd::Zero(size_);
  const auto& s = options_.start;
  for (Eigen::Index i = 0; i < globals_; ++i) switch (parameters_[static_cast<std::size_t>(i)]) {
      case kNeedleCurvature:
        x(i) = s.curvature_per_mm;
        break;
      case kNeedleLambda1:
        x(i) = s.lambda1_per_rad - s.lambda2 * s.lambda2 / (2 * std::numbers::pi);
        break;
      case kNeedleLambda2:
        x(i) = s.lambda2;
        break;
      default:
        x(i) = s.wheelbase_mm;
    }
  set_bounds(x);
  x = x.cwiseMax(low_).cwiseMin(high_);
  std::vector<Block> now;
  std::vector<Block> trial;
  if (!evaluate(x, now))
    throw ArgumentError("from its start the model cannot follow the insertions: the tilt leaves the domain of (25)");

  double damping = 1e-6;
  bool converged = false;
  bool correlation_known = false;
  int iteration = 0;
  for (; iteration < options_.max_iterations; ++iteration) {
    renew_scale(now);
    normal_equations(x, now);
    const double before = cost(x, now);
    bool accepted = false;
    bool small = false;
    while (!accepted && damping < 1e12) {
      MatrixXd A = H_;
      VectorXd b = -g_;
      A.diagonal() += damping * H_.diagonal();
      hold_at_bounds(x, A, b);
      const VectorXd step = A.ldlt().solve(b);
      const VectorXd x_new = (x + step).cwiseMax(low_).cwiseMin(high_);
      const VectorXd moved = x_new - x;
      small = moved.norm() <= options_.tolerance * (options_.tolerance + x.norm());
      if (small) break;
      double after = 0;
      if (step.allFinite() && evaluate(x_new, trial) && (after = cost(x_new, trial)) <= before) {
        accepted = true;
        x = x_new;
        std::swap(now, trial);
        damping = std::max(damping / 10, 1e-12);
        small = before - after <= options_.tolerance * before;
      } else {
        damping *= 10;
      }
    }
    if (!small && accepted) continue;
    if (options_.correct_correlation && !correlation_known) {
      // Known only now that the residuals are noise; it weighs the data against the priors, hence one more round.
      correlation_known = true;
      const double rho = std::max(correlation(now), 0.0);
      inflation_ = (1 + rho) / (1 - rho);
      if (rho > 0 && prior_weight_.maxCoeff() > 0) continue;
    }
    converged = small;
    ++iteration;
    break;
  }
  renew_scale(now);
  if (locals_ > 0 && globals_ > 0) integrate_entries(x, now);
  normal_equations(x, now);
  FitResult r = result(x, now);
  r.iterations = iteration;
  r.converged = converged;
  return r;
}

void TrajectoryFit::hold_at_bounds(const VectorXd& x, MatrixXd& A, VectorXd& b) const {
  for (Eigen::Index i = 0; i < size_; ++i) {
    const bool held = (x(i) <= low_(i) && b(i) < 0) || (x(i) >= high_(i) && b(i) > 0);
    if (!held && A(i, i) > 0) continue;
    A.row(i).setZero();
    A.col(i).setZero();
    A(i, i) = 1;
    b(i) = 0;
  }
}

FitResult TrajectoryFit::result(const VectorXd& x, const std::vector<Block>& blocks) const {
  FitResult r;
  r.needle = needle(x);
  for (std::size_t i = 0; i < insertions_.size(); ++i) r.entries.push_back(entry(x, i));
  r.noise_scale = scale_;
  r.lag1_correlation = correlation(blocks);
  r.cost = cost(x, blocks);
  const VectorXd off = as_parameters(x, parameters_, r.needle) - prior_mean_;
  r.prior_cost = 0.5 * off.cwiseAbs2().dot(prior_weight_);
  r.deviance = deviance(all_residuals(blocks), options_.loss == Loss::huber ? options_.huber_threshold
                                                                            : std::numeric_limits<double>::infinity());
  r.residual_count = residual_count_;
  for (const auto& b : blocks) r.squares += b.residual.squaredNorm();
  if (globals_ == 0) return r;

  // Information of the data about the parameters themselves (not mu), the entries marginalised with their priors.
  double efficiency = 1;
  if (options_.loss == Loss::huber) {
    auto all = all_residuals(blocks);
    for (double& value : all) value /= scale_;
    efficiency = huber_efficiency(all, options_.huber_threshold);
  }
  const double unit = efficiency / (scale_ * scale_ * inflation_);
  MatrixXd M = MatrixXd::Zero(globals_, globals_);
  for (const auto& b : blocks) {
    const MatrixXd h = unit * (b.jacobian.transpose() * b.jacobian);
    M += h.topLeftCorner(globals_, globals_);
    if (locals_ == 0) continue;
    MatrixXd own = h.bottomRightCorner(locals_, locals_);
    own.diagonal() += prior_weight_.segment(globals_, locals_);
    M -= h.topRightCorner(globals_, locals_) * own.ldlt().solve(h.bottomLeftCorner(locals_, globals_));
  }
  MatrixXd to_coordinates = MatrixXd::Identity(globals_, globals_);  // d(coordinates)/d(parameters)
  std::vector<bool> free;
  // (23) binds both lambdas together; steps across it were refused, so the fit ends where it met it.
  const bool at_slip_limit =
      model::find_domain_violation(r.needle, 1.01 * model::kDefaultGammaMax_rad).has_value() &&
      r.needle.lambda1_per_rad > 1.01 * r.needle.lambda2 * r.needle.lambda2 / (2 * std::numbers::pi);
  for (Eigen::Index i = 0; i < globals_; ++i) {
    const Parameter p = parameters_[static_cast<std::size_t>(i)];
    free.push_back(x(i) > low_(i) && x(i) < high_(i) &&
                   !(at_slip_limit && (p == kNeedleLambda1 || p == kNeedleLambda2)));
    if (parameters_[static_cast<std::size_t>(i)] == kNeedleLambda1)
      for (Eigen::Index j = 0; j < globals_; ++j)
        if (parameters_[static_cast<std::size_t>(j)] == kNeedleLambda2)
          to_coordinates(i, j) = -r.needle.lambda2 / std::numbers::pi;
  }
  fill_uncertainty(to_coordinates.transpose() * M * to_coordinates, parameters_, free, options_.priors, r);
  return r;
}

FitResult fit_trajectory(const std::vector<Insertion>& insertions, const FitOptions& options) {
  return TrajectoryFit(insertions, options).run();
}

}  // namespace bevel::diagnosis
