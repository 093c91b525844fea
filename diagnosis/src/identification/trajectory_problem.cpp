// SPDX-License-Identifier: MIT
#include "identification/trajectory_problem.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include <bevel/diagnosis/identification/fit_statistics.hpp>
#include <bevel/error.hpp>

namespace bevel::diagnosis {
namespace {
constexpr double kLambdaMargin = 1e-6;  // keeps (26) strict
constexpr double kMinScale = 1e-9;
}  // namespace

using Eigen::MatrixXd;
using Eigen::VectorXd;

TrajectoryFit::TrajectoryFit(const std::vector<Insertion>& insertions, const FitOptions& options)
    : insertions_(insertions), options_(options) {
  if (insertions.empty()) throw ArgumentError("a fit wants at least one insertion");
  if (const auto violation = model::find_domain_violation(options.start))
    throw ArgumentError("start of the fit: " + model::describe(*violation));
  for (int p = 0; p < kNeedleParameters; ++p)
    if (options.fitted[static_cast<std::size_t>(p)]) parameters_.push_back(static_cast<Parameter>(p));
  for (int e = 0; e < kEntryParameters; ++e) {
    if (!(options.entry_sigma(e) >= 0)) throw ArgumentError("entry_sigma must be 0 or above");
    if (options.entry_sigma(e) > 0) entry_.push_back(static_cast<EntryParameter>(e));
  }
  globals_ = static_cast<Eigen::Index>(parameters_.size());
  locals_ = static_cast<Eigen::Index>(entry_.size());
  size_ = globals_ + locals_ * static_cast<Eigen::Index>(insertions.size());
  if (size_ == 0) throw ArgumentError("nothing to fit: no parameter is free");
  prior_mean_.setZero(size_);
  prior_weight_.setZero(size_);
  for (Eigen::Index i = 0; i < globals_; ++i)
    if (const auto& prior = options.priors[parameters_[static_cast<std::size_t>(i)]]) {
      if (!(prior->sigma > 0)) throw ArgumentError("a prior's sigma must be above 0");
      prior_mean_(i) = prior->mean;
      prior_weight_(i) = 1 / (prior->sigma * prior->sigma);
    }
  for (Eigen::Index i = globals_; i < size_; ++i) {
    const double sigma = options.entry_sigma(entry_[static_cast<std::size_t>((i - globals_) % locals_)]);
    prior_weight_(i) = 1 / (sigma * sigma);
  }
  for (const auto& insertion : insertions)
    for (const auto& o : insertion.observations) residual_count_ += o.rank;
}

model::NeedleParameters TrajectoryFit::needle(const VectorXd& x) const {
  model::NeedleParameters n = options_.start;
  double mu = -1;
  for (Eigen::Index i = 0; i < globals_; ++i) switch (parameters_[static_cast<std::size_t>(i)]) {
      case kNeedleCurvature:
        n.curvature_per_mm = x(i);
        break;
      case kNeedleLambda1:
        mu = x(i);
        break;
      case kNeedleLambda2:
        n.lambda2 = x(i);
        break;
      default:
        n.wheelbase_mm = x(i);
    }
  if (mu >= 0) n.lambda1_per_rad = mu + n.lambda2 * n.lambda2 / (2 * std::numbers::pi);
  return n;
}

Entry TrajectoryFit::entry(const VectorXd& x, std::size_t insertion) const {
  Entry e = Entry::Zero();
  for (Eigen::Index i = 0; i < locals_; ++i)
    e(entry_[static_cast<std::size_t>(i)]) = x(globals_ + static_cast<Eigen::Index>(insertion) * locals_ + i);
  return e;
}

void TrajectoryFit::set_bounds(const VectorXd& x) {
  low_ = VectorXd::Constant(size_, -1e9);
  high_ = VectorXd::Constant(size_, 1e9);
  for (Eigen::Index i = 0; i < globals_; ++i) switch (parameters_[static_cast<std::size_t>(i)]) {
      case kNeedleCurvature:
        low_(i) = -0.0499;
        high_(i) = 0.0499;
        break;
      case kNeedleLambda1:
        low_(i) = kLambdaMargin;
        high_(i) = 20;
        break;
      case kNeedleLambda2: {
        low_(i) = -5;
        high_(i) = 0.99;
        if (options_.fitted[kNeedleLambda1]) break;  // then mu looks after (26)
        const double limit = std::sqrt(2 * std::numbers::pi * needle(x).lambda1_per_rad) - kLambdaMargin;
        low_(i) = -limit;
        high_(i) = std::min(high_(i), limit);
        break;
      }
      default:
        low_(i) = 1.001;
        high_(i) = 999;
    }
}

void TrajectoryFit::evaluate_one(const VectorXd& x, std::size_t i, Block& block) const {
  const Insertion& insertion = insertions_[i];
  const auto n = needle(x);
  block.valid = integrate(insertion, n, entry(x, i), true, block.path);
  if (!block.valid) return;
  Eigen::Index rows = 0;
  for (const auto& o : insertion.observations) rows += o.rank;
  block.residual.resize(rows);
  block.jacobian.resize(rows, globals_ + locals_);
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < insertion.observations.size(); ++k) {
    const Observation& o = insertion.observations[k];
    const auto W = o.whitening.topRows(o.rank);
    block.residual.segment(row, o.rank).noalias() = W * (block.path.position_mm[k] - o.position_mm);
    const auto& J = block.path.jacobian[k];
    for (Eigen::Index c = 0; c < globals_; ++c) {
      const Parameter p = parameters_[static_cast<std::size_t>(c)];
      Eigen::Vector3d column = J.col(p);
      // At fixed mu, lambda1 moves with lambda2.
      if (p == kNeedleLambda2 && options_.fitted[kNeedleLambda1])
        column += J.col(kNeedleLambda1) * n.lambda2 / std::numbers::pi;
      block.jacobian.col(c).segment(row, o.rank).noalias() = W * column;
    }
    for (Eigen::Index c = 0; c < locals_; ++c)
      block.jacobian.col(globals_ + c).segment(row, o.rank).noalias() =
          W * J.col(entry_column(entry_[static_cast<std::size_t>(c)]));
    row += o.rank;
  }
}

bool TrajectoryFit::evaluate(const VectorXd& x, std::vector<Block>& blocks) const {
  if (model::find_domain_violation(needle(x))) return false;
  blocks.resize(insertions_.size());
  const std::size_t workers = std::clamp<std::size_t>(static_cast<std::size_t>(options_.threads), 1, blocks.size());
  const auto work = [&](std::size_t first) {
    for (std::size_t i = first; i < blocks.size(); i += workers) evaluate_one(x, i, blocks[i]);
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t w = 1; w < workers; ++w) others.emplace_back(work, w);
    work(0);
  }
  return std::all_of(blocks.begin(), blocks.end(), [](const Block& b) { return b.valid; });
}

std::vector<double> TrajectoryFit::all_residuals(const std::vector<Block>& blocks) const {
  std::vector<double> all;
  all.reserve(static_cast<std::size_t>(residual_count_));
  for (const auto& b : blocks) all.insert(all.end(), b.residual.begin(), b.residual.end());
  return all;
}

void TrajectoryFit::renew_scale(const std::vector<Block>& blocks) {
  if (!options_.estimate_scale) return;
  if (options_.loss == Loss::huber) {
    auto all = all_residuals(blocks);
    scale_ = std::max(robust_scale(all), kMinScale);
    return;
  }
  double squares = 0;
  for (const auto& b : blocks) squares += b.residual.squaredNorm();
  scale_ =
      std::max(std::sqrt(squares / static_cast<double>(std::max<Eigen::Index>(residual_count_ - size_, 1))), kMinScale);
}

// The parameters that priors speak of: lambda1 itself, not its coordinate mu.
VectorXd as_parameters(VectorXd x, const std::vector<Parameter>& parameters, const model::NeedleParameters& needle) {
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (parameters[i] == kNeedleLambda1) x(static_cast<Eigen::Index>(i)) = needle.lambda1_per_rad;
  return x;
}

double TrajectoryFit::cost(const VectorXd& x, const std::vector<Block>& blocks) const {
  const double c = options_.huber_threshold;
  double sum = 0;
  for (const auto& b : blocks) {
    if (options_.loss == Loss::square) {
      sum += b.residual.squaredNorm() / (2 * scale_ * scale_);
      continue;
    }
    for (const double r : b.residual) {
      const double t = std::abs(r) / scale_;
      sum += t <= c ? 0.5 * t * t : c * (t - 0.5 * c);
    }
  }
  const VectorXd off = as_parameters(x, parameters_, needle(x)) - prior_mean_;
  return sum / inflation_ + 0.5 * off.cwiseAbs2().dot(prior_weight_);
}

void TrajectoryFit::normal_equations(const VectorXd& x, const std::vector<Block>& blocks) {
  H_.setZero(size_, size_);
  g_.setZero(size_);
  MatrixXd weighted;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& b = blocks[i];
    weighted = b.jacobian;
    if (options_.loss == Loss::huber)
      for (Eigen::Index r = 0; r < b.residual.size(); ++r) {
        const double t = std::abs(b.residual(r)) / (scale_ * options_.huber_threshold);
        if (t > 1) weighted.row(r) /= t;
      }
    const double unit = 1 / (scale_ * scale_ * inflation_);
    const MatrixXd h = unit * (weighted.transpose() * b.jacobian);
    const VectorXd d = unit * (weighted.transpose() * b.residual);
    const Eigen::Index at = globals_ + static_cast<Eigen::Index>(i) * locals_;
    H_.topLeftCorner(globals_, globals_) += h.topLeftCorner(globals_, globals_);
    g_.head(globals_) += d.head(globals_);
    H_.block(0, at, globals_, locals_) = h.topRightCorner(globals_, locals_);
    H_.block(at, 0, locals_, globals_) = h.bottomLeftCorner(locals_, globals_);
    H_.block(at, at, locals_, locals_) = h.bottomRightCorner(locals_, locals_);
    g_.segment(at, locals_) = d.tail(locals_);
  }
  const auto n = needle(x);
  const VectorXd off = as_parameters(x, parameters_, n) - prior_mean_;
  VectorXd row(size_);
  for (Eigen::Index i = 0; i < size_; ++i) {
    if (prior_weight_(i) == 0) continue;
    row.setZero();
    row(i) = 1;
    if (i < globals_ && parameters_[static_cast<std::size_t>(i)] == kNeedleLambda1)
      for (Eigen::Index j = 0; j < globals_; ++j)
        if (parameters_[static_cast<std::size_t>(j)] == kNeedleLambda2) row(j) = n.lambda2 / std::numbers::pi;
    H_ += prior_weight_(i) * row * row.transpose();
    g_ += prior_weight_(i) * off(i) * row;
  }
}

double TrajectoryFit::correlation(const std::vector<Block>& blocks) const {
  // Each camera axis of each insertion is one series.
  std::vector<double> values;
  std::vector<std::size_t> starts{0};
  const double limit = options_.huber_threshold * scale_;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Index row = 0;
      for (const auto& o : insertions_[i].observations) {
        if (axis < o.rank) values.push_back(std::clamp(blocks[i].residual(row + axis), -limit, limit));
        row += o.rank;
      }
      starts.push_back(values.size());
    }
  return lag1_correlation(values, starts);
}

}  // namespace bevel::diagnosis
