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

// The box in which the refit moves: k, lambda1 above the least that (26) of the paper allows, lambda2.
using Point = Eigen::Vector3d;
const Point kLowest(1e-4, 0.0, -0.6);
const Point kHighest(0.03, 2.5, 0.6);

double least_lambda1(double lambda2) { return lambda2 * lambda2 / (2.0 * std::numbers::pi) + 1e-3; }

Point point_of(const BaseNeedle& needle) {
  const Point p(needle.curvature_per_mm, needle.lambda1_per_rad - least_lambda1(needle.lambda2), needle.lambda2);
  return p.cwiseMax(kLowest).cwiseMin(kHighest);
}

BaseNeedle needle_at(const Point& p, const BaseNeedle& like) {
  BaseNeedle needle = like;
  needle.curvature_per_mm = p(0);
  needle.lambda1_per_rad = least_lambda1(p(2)) + p(1);
  needle.lambda2 = p(2);
  return needle;
}

// The damped step; what stands at a bound and wants beyond stays there.
Point step_from(const Point& p, Eigen::Matrix3d normal, Point gradient, double damping) {
  normal.diagonal() *= 1.0 + damping;
  for (Eigen::Index j = 0; j < 3; ++j) {
    const bool stays = (p(j) <= kLowest(j) && gradient(j) > 0) || (p(j) >= kHighest(j) && gradient(j) < 0);
    if (!stays) continue;
    normal.row(j).setZero();
    normal.col(j).setZero();
    normal(j, j) = 1.0;
    gradient(j) = 0.0;
  }
  return (p - normal.ldlt().solve(gradient)).cwiseMax(kLowest).cwiseMin(kHighest);
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
  Point point = point_of(start);
  const auto misfit_at = [&](const Point& p) { return misfit(setting, seen, needle_at(p, start), known); };
  auto residual = misfit_at(point);
  if (!residual) throw std::domain_error("the refit starts outside the model's domain");
  bool converged = false;
  double damping = 1e-6;
  for (int iteration = 0; iteration < 40 && !converged; ++iteration) {
    Eigen::MatrixXd jacobian(residual->size(), 3);
    for (Eigen::Index j = 0; j < 3; ++j) {
      Point moved = point;
      const double probe = kProbe[static_cast<std::size_t>(j)] * (point(j) >= kHighest(j) ? -1.0 : 1.0);
      moved(j) += probe;
      const auto there = misfit_at(moved);
      if (!there) return {needle_at(point, start), residual->norm(), false};
      jacobian.col(j) = (*there - *residual) / probe;
    }
    const Eigen::Matrix3d normal = jacobian.transpose() * jacobian;
    const Point gradient = jacobian.transpose() * *residual;
    const double before = residual->squaredNorm();
    bool better = false;
    for (int attempt = 0; attempt < 12 && !better; ++attempt) {
      const Point moved = step_from(point, normal, gradient, damping);
      const auto there = misfit_at(moved);
      better = there && there->squaredNorm() < before;
      if (better) {
        point = moved;
        residual = there;
      } else {
        damping *= 10.0;
      }
    }
    // A hundredth of a unit of chi-square is nothing to anybody; of a step held short it says nothing.
    converged = !better || (before - residual->squaredNorm() < 1e-2 && damping < 1e-2);
    damping = std::max(damping * 0.03, 1e-9);
  }
  return {needle_at(point, start), residual->norm(), converged};
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
