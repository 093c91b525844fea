#include "proof/visibility.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace bevel::proof {
namespace {

constexpr std::array<double BaseNeedle::*, 3> kFree{&BaseNeedle::curvature_per_mm, &BaseNeedle::lambda1_per_rad,
                                                    &BaseNeedle::lambda2};
constexpr std::array<double, 3> kProbe{2e-6, 2e-4, 2e-4};

// Into the set where the model is defined, (26) and (24) of the paper.
void keep_in_domain(BaseNeedle& needle) {
  needle.lambda2 = std::clamp(needle.lambda2, -0.6, 0.6);
  const double least = needle.lambda2 * needle.lambda2 / (2.0 * std::numbers::pi) + 1e-3;
  needle.lambda1_per_rad = std::clamp(needle.lambda1_per_rad, least, 2.5);
  needle.curvature_per_mm = std::clamp(needle.curvature_per_mm, 1e-4, 0.03);
}

std::optional<Eigen::VectorXd> misfit(const Setting& setting, const Views& seen, const BaseNeedle& needle,
                                      const HiddenPhysics& known) {
  try {
    return whitened_difference(setting, seen, views_of(setting, needle, known));
  } catch (const std::domain_error&) {
    return std::nullopt;
  }
}

}  // namespace

Views views_of(const Setting& setting, const BaseNeedle& needle, const HiddenPhysics& physics) {
  Views views;
  for (std::size_t i = 0; i < setting.motions.size(); ++i) {
    const TipPath path = travel(needle, setting.motions[i], physics, setting.ripple, static_cast<int>(i));
    views.push_back(view(path, setting.frames[i].times_s, physics));
  }
  return views;
}

Eigen::VectorXd whitened_difference(const Setting& setting, const Views& a, const Views& b) {
  Eigen::Index total = 0;
  for (const auto& v : a) total += v.size();
  Eigen::VectorXd all(total);
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::VectorXd part = setting.whiteners[i](a[i] - b[i]);
    all.segment(at, part.size()) = part;
    at += part.size();
  }
  return all;
}

Refit refit_base(const Setting& setting, const Views& seen, const BaseNeedle& start, const HiddenPhysics& known) {
  Refit fit{start, 0, false};
  keep_in_domain(fit.needle);
  auto residual = misfit(setting, seen, fit.needle, known);
  if (!residual) throw std::domain_error("the refit starts outside the model's domain");
  double damping = 1e-6;
  for (int iteration = 0; iteration < 25; ++iteration) {
    Eigen::MatrixXd jacobian(residual->size(), 3);
    for (std::size_t j = 0; j < kFree.size(); ++j) {
      BaseNeedle moved = fit.needle;
      moved.*kFree[j] += kProbe[j];
      const auto there = misfit(setting, seen, moved, known);
      if (!there) return fit;
      jacobian.col(static_cast<Eigen::Index>(j)) = (*there - *residual) / kProbe[j];
    }
    const Eigen::Matrix3d normal = jacobian.transpose() * jacobian;
    const Eigen::Vector3d gradient = jacobian.transpose() * *residual;
    const double now = residual->squaredNorm();
    bool better = false;
    for (int attempt = 0; attempt < 8 && !better; ++attempt, damping *= 10) {
      Eigen::Matrix3d damped = normal;
      damped.diagonal() *= 1.0 + damping;
      const Eigen::Vector3d step = damped.ldlt().solve(gradient);
      BaseNeedle moved = fit.needle;
      for (std::size_t j = 0; j < kFree.size(); ++j) moved.*kFree[j] -= step(static_cast<Eigen::Index>(j));
      keep_in_domain(moved);
      const auto there = misfit(setting, seen, moved, known);
      if (!there || there->squaredNorm() >= now) continue;
      better = true;
      fit.needle = moved;
      residual = there;
    }
    damping = std::max(damping * 1e-2, 1e-9);
    fit.sigmas = residual->norm();
    // A hundredth of a unit of chi-square is nothing to anybody.
    if (!better || now - residual->squaredNorm() < 1e-2) {
      fit.converged = true;
      break;
    }
  }
  fit.sigmas = residual->norm();
  return fit;
}

BaseTangent::BaseTangent(const Setting& setting, const BaseNeedle& needle, const HiddenPhysics& physics) {
  const Views here = views_of(setting, needle, physics);
  for (std::size_t j = 0; j < kFree.size(); ++j) {
    BaseNeedle moved = needle;
    moved.*kFree[j] += kProbe[j];
    also(whitened_difference(setting, views_of(setting, moved, physics), here) / kProbe[j]);
  }
}

void BaseTangent::also(const Eigen::VectorXd& direction) {
  Eigen::VectorXd rest = direction;
  for (int twice = 0; twice < 2; ++twice)
    for (const auto& q : basis_) rest -= q.dot(rest) * q;
  if (rest.norm() > 1e-9 * direction.norm()) basis_.push_back(rest.normalized());
}

double BaseTangent::norm_beyond(const Eigen::VectorXd& difference) const {
  Eigen::VectorXd rest = difference;
  for (const auto& q : basis_) rest -= q.dot(rest) * q;
  return rest.norm();
}

}  // namespace bevel::proof
