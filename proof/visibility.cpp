// SPDX-License-Identifier: MIT
#include "proof/visibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <bevel/error.hpp>
#include "proof/bounded_fit.hpp"

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

BaseNeedle needle_at(const Eigen::VectorXd& p, const BaseNeedle& like) {
  BaseNeedle needle = like;
  needle.curvature_per_mm = p(0);
  needle.lambda1_per_rad = least_lambda1(p(2)) + p(1);
  needle.lambda2 = p(2);
  return needle;
}

std::optional<Eigen::VectorXd> misfit(const Setting& setting, const Views& seen, const BaseNeedle& needle,
                                      const HiddenPhysics& known) {
  try {
    return whitened_difference(setting, seen, views_of(setting, needle, known));
  } catch (const DomainError&) {
    return std::nullopt;
  }
}

// Where to look for k, lambda1 and lambda2, and where to begin, with room for so many unknowns of one's own after them.
struct Search {
  BoundedProblem problem;
  Eigen::VectorXd from;
};
template <class Residual>
Search search_about(const BaseNeedle& start, Eigen::Index own, Residual residual) {
  const Eigen::VectorXd room = Eigen::VectorXd::Zero(3 + own);
  Search search{{std::move(residual), room, room, room}, room};
  search.problem.lowest.head<3>() = kLowest;
  search.problem.highest.head<3>() = kHighest;
  search.problem.probe.head<3>() = Point(kProbe.data());
  search.from.head<3>() = point_of(start);
  return search;
}

}  // namespace

Views views_of(const Setting& setting, const BaseNeedle& needle, const HiddenPhysics& physics) {
  Views views;
  for (std::size_t i = 0; i < setting.motions.size(); ++i) {
    const InsertionVariation own = setting.variation.empty() ? InsertionVariation{} : setting.variation[i];
    HiddenPhysics here = setting.changed.empty() || setting.changed[i] ? physics : HiddenPhysics{};
    BaseNeedle varied = needle;
    varied.curvature_per_mm *= (1.0 + own.curvature_share) * (1.0 + here.curvature_change);
    varied.lambda1_per_rad += here.lambda1_change_per_rad;
    here.entry_about_x_rad += own.about_x_rad;
    here.entry_about_y_rad += own.about_y_rad;
    here.bevel_offset_rad += own.roll_rad;
    const TipPath path = travel(varied, setting.motions[i], here, setting.ripple, static_cast<int>(i));
    views.push_back(view(path, setting.frames[i].times_s, here));
    views.back().colwise() += Eigen::Vector3d(own.entry_x_mm, own.entry_y_mm, 0);
  }
  return views;
}

Eigen::VectorXd whitened_difference(const Setting& setting, const Views& a, const Views& b) {
  Eigen::Index total = 0;
  for (const auto& v : a) total += v.size();
  Eigen::VectorXd all(total);
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    Eigen::VectorXd part = setting.whiteners[i](a[i] - b[i]);
    if (!setting.absorbers.empty()) part = setting.absorbers[i](part);
    all.segment(at, part.size()) = part;
    at += part.size();
  }
  return all;
}

std::vector<Absorber> find_absorbers(const Setting& setting, const BaseNeedle& needle, const VariationSpread& spread) {
  Setting here = setting;
  here.absorbers.clear();
  if (here.variation.empty()) here.variation.resize(here.motions.size());
  const Views bare = views_of(here, needle, {});
  std::vector<Eigen::MatrixXd> directions(here.motions.size());
  for (int k = 0; k < InsertionVariation::kCount; ++k) {
    constexpr double kStep = 0.1;  // of a standard deviation
    Setting moved = here;
    for (InsertionVariation& one : moved.variation) one[k] += kStep * spread[k];
    const Views there = views_of(moved, needle, {});
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const Eigen::VectorXd column = here.whiteners[i](there[i] - bare[i]) / kStep;
      if (k == 0) directions[i].resize(column.size(), InsertionVariation::kCount);
      directions[i].col(k) = column;
    }
  }
  std::vector<Absorber> absorbers;
  for (const auto& one : directions) absorbers.emplace_back(one);
  return absorbers;
}

Refit refit_base(const Setting& setting, const Views& seen, const BaseNeedle& start, const HiddenPhysics& known) {
  const auto [problem, from] = search_about(
      start, 0, [&](const Eigen::VectorXd& x) { return misfit(setting, seen, needle_at(x, start), known); });
  const BoundedFit fit = fit_in_box(problem, from, 40, std::numeric_limits<double>::infinity());
  return {needle_at(fit.point, start), fit.norm, fit.converged};
}

std::vector<Rival> find_rivals(const Setting& setting, const Views& seen, const BaseNeedle& start,
                               double limit_sigmas) {
  std::vector<Rival> rivals;
  std::vector<EffectKind> kinds = catalogue();
  if (!setting.changed.empty()) kinds.insert(kinds.end(), needle_changes().begin(), needle_changes().end());
  for (const EffectKind& kind : kinds) {
    // Instants and phases of single recordings are not searched: neither imitates what lasts through all recordings.
    // Nor are jumps of one length: small steps do not lead to it.
    const std::string name = kind.name;
    if (!kind.listed || name == "lost_steps" || name == "tissue_motion" || name == "stick_slip") continue;
    const auto& parameters = kind.parameters;
    const auto own = static_cast<Eigen::Index>(name == "slip_direction" ? 0 : parameters.size());
    const auto physics_at = [&](const Eigen::VectorXd& x) {
      HiddenPhysics physics;
      physics.departure = 0;
      if (own == 0) physics.other_slip = 1;
      for (Eigen::Index j = 0; j < own; ++j) physics.*parameters[static_cast<std::size_t>(j)].slot = x(3 + j);
      return physics;
    };
    auto [problem, from] = search_about(start, own, [&](const Eigen::VectorXd& x) {
      return misfit(setting, seen, needle_at(x.head<3>(), start), physics_at(x));
    });
    for (Eigen::Index j = 0; j < own; ++j) {
      const ParameterRange& range = parameters[static_cast<std::size_t>(j)];
      const double reach = std::max(std::abs(range.high - range.neutral), std::abs(range.low - range.neutral));
      const bool from_zero = range.is_size && !range.either_sign && range.neutral == 0;
      problem.lowest(3 + j) = !range.is_size ? 0.3 * range.low : from_zero ? 0.0 : range.neutral - 3 * reach;
      problem.highest(3 + j) = range.is_size ? range.neutral + 3 * reach : 2 * range.high;
      if (range.neutral == 1) problem.lowest(3 + j) = std::max(problem.lowest(3 + j), 0.2);
      problem.probe(3 + j) = 2e-3 * (range.is_size ? reach : range.high);
      from(3 + j) = range.is_size ? range.neutral + 0.2 * reach : 0.5 * (range.low + range.high);
    }
    const BoundedFit fit = fit_in_box(problem, from, 15, 6 * limit_sigmas);
    if (fit.norm < limit_sigmas) rivals.push_back({name, fit.norm});
  }
  return rivals;
}

std::vector<std::map<std::string, double>> nearest_plain(const Setting& setting, const Views& seen,
                                                         const BaseNeedle& start,
                                                         const std::vector<ConcealedEffect>& effects) {
  Setting smooth = setting;
  smooth.ripple = {};
  std::vector<ConcealedEffect> moved = effects;
  std::vector<double*> slots;
  for (ConcealedEffect& effect : moved)
    for (auto& [name, value] : effect.parameters) slots.push_back(&value);
  const auto own = static_cast<Eigen::Index>(slots.size());
  const auto set = [&](const Eigen::VectorXd& x) {
    for (Eigen::Index j = 0; j < own; ++j) *slots[static_cast<std::size_t>(j)] = x(3 + j);
  };
  auto [problem, from] = search_about(start, own, [&](const Eigen::VectorXd& x) {
    set(x);
    return misfit(smooth, seen, needle_at(x.head<3>(), start), physics_of(moved, 0.0));
  });
  for (Eigen::Index j = 0; j < own; ++j) {
    const double value = *slots[static_cast<std::size_t>(j)];
    from(3 + j) = value;
    problem.lowest(3 + j) = value - 0.5 * std::abs(value);
    problem.highest(3 + j) = value + 0.5 * std::abs(value);
    problem.probe(3 + j) = 2e-3 * std::abs(value) + 1e-9;
  }
  set(fit_in_box(problem, from, 15, std::numeric_limits<double>::infinity()).point);
  std::vector<std::map<std::string, double>> nearest;
  for (const ConcealedEffect& effect : moved) nearest.push_back(effect.parameters);
  return nearest;
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
