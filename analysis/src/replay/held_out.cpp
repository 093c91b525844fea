// SPDX-License-Identifier: MIT
#include <bevel/analysis/replay/held_out.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace bevel::analysis {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// In units of the prior's standard deviations, from the prior's mean: the prior is the unit normal.
struct Learned {
  Matrix3d information = Matrix3d::Zero();
  Vector3d vector = Vector3d::Zero();  // information times mean
};

Vector3d parameters_of(const model::NeedleParameters& needle) {
  return {needle.curvature_per_mm, needle.lambda1_per_rad, needle.lambda2};
}

Vector3d widths_of(const estimator::Prior& prior) {
  return {estimator::insertion_curvature_sd_per_mm(prior), prior.lambda1_sd_per_rad, prior.lambda2_sd};
}

Learned learned_by(const Replay& replay) {
  Learned learned;
  if (replay.states.empty()) return learned;
  const estimator::FilterState last = replay.states.back().state.unpacked();
  const Vector3d sd = widths_of(replay.config.prior);
  const Vector3d moved =
      Vector3d(last.curvature_per_mm, last.lambda1_per_rad, last.lambda2) - parameters_of(replay.config.prior.needle);
  Matrix3d covariance = Matrix3d::Identity();
  Vector3d mean = Vector3d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (!(sd[i] > 0)) continue;
    mean[i] = moved[i] / sd[i];
    for (Eigen::Index j = 0; j < 3; ++j)
      if (sd[j] > 0) covariance(i, j) = last.covariance(6 + i, 6 + j) / (sd[i] * sd[j]);
  }
  const Matrix3d posterior = covariance.inverse();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> gained(posterior - Matrix3d::Identity());
  const Vector3d vector = posterior * mean;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double value = gained.eigenvalues()[i];
    if (!(value > 0)) continue;  // process noise may leave less than the prior had
    const Vector3d axis = gained.eigenvectors().col(i);
    learned.information += value * axis * axis.transpose();
    learned.vector += axis * axis.dot(vector);
  }
  return learned;
}

// Towards the prior's mean, which is valid, as far as it takes.
model::NeedleParameters valid_needle(const model::NeedleParameters& from, Vector3d step) {
  for (;; step *= 0.9) {
    model::NeedleParameters needle = from;
    needle.curvature_per_mm += step[0];
    needle.lambda1_per_rad += step[1];
    needle.lambda2 += step[2];
    if (step.isZero(1e-12) || !model::find_domain_violation(needle)) return needle;
  }
}

}  // namespace

std::vector<estimator::EstimatorConfig> held_out_configs(const std::vector<Replay>& replays, double width) {
  std::vector<Learned> learned;
  learned.reserve(replays.size());
  for (const Replay& replay : replays) learned.push_back(learned_by(replay));
  std::vector<estimator::EstimatorConfig> configs;
  configs.reserve(replays.size());
  for (std::size_t own = 0; own < replays.size(); ++own) {
    Matrix3d information = Matrix3d::Identity();
    Vector3d vector = Vector3d::Zero();
    for (std::size_t i = 0; i < learned.size(); ++i) {
      if (i == own) continue;
      information += learned[i].information;
      vector += learned[i].vector;
    }
    configs.push_back(replays[own].config);
    estimator::Prior& prior = configs.back().prior;
    const Vector3d mean = information.llt().solve(vector).cwiseProduct(widths_of(prior));
    prior.needle = valid_needle(prior.needle, mean);
    prior.curvature_sd_per_mm *= width;
    prior.lambda1_sd_per_rad *= width;
    prior.lambda2_sd *= width;
  }
  return configs;
}

}  // namespace bevel::analysis
