// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/profile.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <bevel/diagnosis/inference/own_volume.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kNegligible = 20;  // of chi2: values beyond have no part in an integral
constexpr double kFirstStep = 0.1;  // of what is near
constexpr double kGrowth = 1.15;    // of the steps
constexpr int kMostSteps = 60;      // to each side
// Of an instant that follows: its steps, each half of the one before, down to 6 ms.
constexpr double kWidestStep_s = 0.2;
constexpr int kSteps = 6;
// Of refits: where the parabola is tried, and by how much of it the rise may be off there; the root's rise in a step,
// at least and at most; where nothing is left, also where the model has no value; fits to each side.
constexpr double kTried_sd = 2, kOffParabola = 0.25;
constexpr double kLeastRise = 0.4, kMostRise = 1.2, kNothingLeft = 3.5;
constexpr int kMostRefits = 24, kBetween = 6;

std::vector<ProfileStep> of_sum_one(std::vector<ProfileStep> steps) {
  double sum = 0;
  for (const ProfileStep& one : steps) sum += one.weight;
  for (ProfileStep& one : steps) one.weight /= sum;
  return steps;
}

}  // namespace

Profile::Profile(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fit)
    : likelihood_(likelihood), curve_(curve), fit_(fit), free_(free_locals(fit.layout)) {
  LinearRecording recording;
  for (std::size_t r = 0; r < likelihood.recordings(); ++r) {
    if (!linearise(likelihood, fit, curve, r, recording)) return;
    Z_.push_back(std::move(recording.Z));
    L_.push_back(std::move(recording.L));
    blocks_.push_back(std::move(recording.block));
  }
  valid_ = true;
}

double Profile::at(Index which, double value, VectorXd& shared, std::vector<VectorXd>& local) const {
  shared = fit_.shared;
  shared[which] = value;
  const VectorXd away = shared - fit_.shared;
  double volume = 0;
  std::vector<VectorXd> instants = fit_.local;
  for (std::size_t r = 0; r < instants.size(); ++r)
    for (std::size_t i = 0; i < fit_.layout.local().size(); ++i)
      if (fit_.layout.is_instant(i)) instants[r][static_cast<Index>(i)] = local[r][static_cast<Index>(i)];
  Residuals residuals;
  auto blocks = blocks_;
  for (std::size_t r = 0; r < blocks.size(); ++r) {
    if (!likelihood_.evaluate(fit_.layout, r, shared, instants[r], false, residuals, curve_, fit_.curve_values))
      return std::numeric_limits<double>::infinity();
    blocks[r].lw = L_[r].transpose() * residuals.white;
    blocks[r].zw = Z_[r].transpose() * residuals.white;
    blocks[r].ww = residuals.white.squaredNorm();
    volume += 2 * blocks[r].slope.dot(away.head(blocks[r].slope.size()));
  }
  const Pulls pulls = pulls_of(fit_.layout, shared, fit_.curve_values, curve_.covariance);
  ArrowRules how{.held = fit_.held};
  if (std::ranges::count(how.held, which) == 0) how.held.push_back(which);
  const ArrowSolution step = solve(blocks, pulls.precision, pulls.centre, how);
  if (!step.valid) return std::numeric_limits<double>::infinity();
  shared += step.shared.head(shared.size());
  local = std::move(instants);
  for (std::size_t r = 0; r < local.size(); ++r)
    for (std::size_t i = 0; i < free_.size(); ++i) local[r][free_[i]] += step.local[r][static_cast<Index>(i)];
  return step.least + volume;
}

double Profile::chi2(std::size_t r, const VectorXd& shared, const VectorXd& local) const {
  Residuals residuals;
  if (!likelihood_.evaluate(fit_.layout, r, shared, local, false, residuals, curve_, fit_.curve_values))
    return std::numeric_limits<double>::infinity();
  return residuals.white.squaredNorm();
}

double Profile::following_instants(Index which, double value, VectorXd& shared, std::vector<VectorXd>& local) const {
  const Layout& layout = fit_.layout;
  const int member = layout.shared()[static_cast<std::size_t>(which)].member;
  shared[which] = value;
  for (std::size_t i = 0; i < layout.local().size(); ++i) {
    if (!layout.is_instant(i) || layout.local()[i].member != member) continue;
    const auto at = static_cast<Index>(i);
    for (std::size_t r = 0; r < local.size(); ++r) {
      if (!(local[r][at] > 0)) continue;
      VectorXd trial = local[r];
      double least = chi2(r, shared, trial);
      for (int halvings = 0; halvings < kSteps; ++halvings)
        for (const double direction : {-1.0, 1.0}) {
          const double step_s = std::ldexp(direction * kWidestStep_s, -halvings);
          trial[at] = std::clamp(local[r][at] + step_s, kEarliest_s, layout.upper(i, r));
          if (const double there = chi2(r, shared, trial); there < least) least = there, local[r] = trial;
        }
    }
  }
  return at(which, value, shared, local);
}

std::vector<ProfileStep> posterior_along(const Profile& profile, Index which, double near) {
  const Fit& fit = profile.fit();
  const Parameter& p = *fit.layout.shared()[static_cast<std::size_t>(which)].parameter;
  const double mode = fit.shared[which];
  VectorXd at_mode;
  std::vector<VectorXd> local = fit.local;
  const double least = profile.at(which, mode, at_mode, local);
  std::vector<ProfileStep> out;
  for (const double direction : {-1.0, 1.0}) {
    double width = kFirstStep * near, edge = mode, before = 1;
    VectorXd shared = at_mode;
    local = fit.local;
    for (int i = 0; i < kMostSteps; ++i, width *= kGrowth) {
      const double end = std::clamp(edge + direction * width, p.lower, p.upper);
      if (end == edge) break;
      const double cost = profile.following_instants(which, end, shared, local);
      const double now = std::exp(-0.5 * std::clamp(cost - least, -kNegligible, 1e3));
      out.push_back({.weight = 0.5 * (before + now) * std::abs(end - edge),
                     .middle = 0.5 * (edge + end),
                     .width = std::abs(end - edge)});
      edge = end, before = now;
      if (now < std::exp(-0.5 * kNegligible)) break;
    }
  }
  return of_sum_one(std::move(out));
}

std::vector<ProfileStep> posterior_by_refits(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fit,
                                             Index which, const VectorXd& by_which, double near, bool parabola) {
  const Parameter& p = *fit.layout.shared()[static_cast<std::size_t>(which)].parameter;
  // From a fit nearby: the others moved with it by the linear model.
  const auto fitted_at = [&](const Fit& from, double value) {
    const VectorXd shared = from.shared + (value - from.shared[which]) * by_which;
    return inference::fit(likelihood, fit.layout, shared, from.local, fit.scales, curve,
                          {.fixed = {which}, .own_volume = fit.own_volume});
  };
  const auto total_of = [&](const Fit& there) {
    if (!there.valid) return std::numeric_limits<double>::infinity();
    if (!fit.own_volume) return there.cost;
    const auto blocks = linearise(likelihood, there, curve);
    return blocks.empty() ? std::numeric_limits<double>::infinity() : there.cost + log_own_volume(blocks);
  };
  // All else follows by the slopes of the own volume, to where it is a mode by them: from there on, nothing jumps.
  Fit mode = fitted_at(fit, fit.shared[which]);
  if (!mode.valid) mode = fit;
  const double least = total_of(mode);
  const auto root_of = [&](const Fit& there) {
    return std::min(std::sqrt(std::max(0.0, total_of(there) - least)), kNothingLeft);
  };
  const auto is_parabola = [&](double direction) {
    const double value = fit.shared[which] + direction * kTried_sd * near;
    if (value < p.lower || value > p.upper) return false;  // what is cut off is no normal density
    const double root = root_of(fitted_at(mode, value));
    return std::abs(root * root - kTried_sd * kTried_sd) <= kOffParabola * kTried_sd * kTried_sd;
  };
  if (parabola && is_parabola(-1) && is_parabola(1)) return {};
  std::vector<ProfileStep> out;
  for (const double direction : {-1.0, 1.0}) {
    Fit from = mode;
    double root = 0, step = near;
    for (int i = 0; i < kMostRefits && root < kNothingLeft; ++i) {
      const double begin = from.shared[which], end = std::clamp(begin + direction * step, p.lower, p.upper);
      if (end == begin) break;
      Fit there = fitted_at(from, end);
      const double risen = root_of(there);
      if (risen - root > kMostRise && i + 1 < kMostRefits) {
        step *= 0.5;
        continue;
      }
      for (int k = 0; k < kBetween; ++k) {
        const double share = (k + 0.5) / kBetween, at = root + share * (risen - root);
        const double width = std::abs(end - begin) / kBetween;
        out.push_back(
            {.weight = std::exp(-0.5 * at * at) * width, .middle = begin + share * (end - begin), .width = width});
      }
      if (risen - root < kLeastRise) step *= 2;
      root = risen, from = std::move(there);
    }
  }
  return of_sum_one(std::move(out));
}

}  // namespace bevel::inference
