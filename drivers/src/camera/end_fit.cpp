// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/end_fit.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "camera/end_problem.hpp"

namespace bevel::camera {
namespace {

using namespace end;  // NOLINT(google-build-using-namespace): the problem is this file's other half

Prior prior_from(const EndPriors& known, const Problem& problem) {
  const auto of_sd = [](double sd) { return 1.0 / (sd * sd); };
  Prior prior;
  prior.mean = Vector::zeros();
  prior.mean[height] = known.height, prior.mean[log_bevel] = std::log(known.bevel_px), prior.mean[pale] = 0.1;
  prior.information[height] = of_sd(0.2 * known.height), prior.information[base] = of_sd(0.04 * known.height);
  prior.information[log_bevel] = of_sd(known.bevel_log_sd), prior.information[pale] = of_sd(0.25);
  prior.information[c0] = prior.information[c1] = 1e-4;
  const double bend_px = 0.5 * problem.length_px() * problem.length_px();  // of unit curvature
  if (known.curvature_sigma_per_px > 0.0) prior.information[c2] = of_sd(known.curvature_sigma_per_px * bend_px);
  prior.hold_bends(1e-9 * bend_px);
  return prior;
}

/// Which end it is has been told with an axis that does not bend, for what is printed beside an end is not to be taken
/// for a bend. How the axis lies there is told with one that may: where the needle was turned its curvature changes at
/// once, and whatever is taken to go on from before the turn is an offset that all frames after it have in common.
void set_axis(Problem& problem, Vector p, Prior prior, const Noise& noise, const EndPriors& known, EndFit& fit) {
  const double length = problem.length_px();
  prior.hold_bends(0.5 * length * length * std::max(known.curvature_change_per_px / std::sqrt(kBends), 1e-9));
  const double tip_s = p[tip], t = problem.t(tip_s);
  problem.descend(p, prior, noise, 6);
  const Matrix covariance = problem.assemble(p, prior, noise, true).normal.inv(cv::DECOMP_CHOLESKY);
  fit.tip.across_px = problem.offset(p, tip_s);
  fit.slope = (p[c1] + 2.0 * t * p[c2]) / length;
  Vector across{}, slope{};
  across[c0] = 1.0, across[c1] = t, across[c2] = t * t;
  slope[c1] = 1.0 / length, slope[c2] = 2.0 * t / length;
  fit.tip.across_variance_px2 = across.dot(covariance * across);
  fit.slope_variance = slope.dot(covariance * slope);
}

struct Mode {
  Vector p;
  double cost = 0.0;
};

}  // namespace

EndFit fit_end(const EndProfile& profile, const EndPriors& priors) {
  EndFit fit;
  if (profile.dark.size() < 16 || profile.dark.size() != profile.moment.size() ||
      profile.dark.size() != profile.spread.size() || priors.height <= 0.0)
    return fit;
  Problem problem(profile, priors);
  const Prior prior = prior_from(priors, problem);
  Noise noise;
  noise.sigma.fill(0.06 * priors.height);
  noise.correlation_px.fill(3.0);

  auto starts = problem.coarse(prior, noise);
  std::sort(starts.begin(), starts.end());
  const double apart_px = std::max(6.0, 0.5 * priors.bevel_px);
  std::vector<Mode> modes;
  for (const auto& [cost, at] : starts) {
    const bool near_one = std::any_of(modes.begin(), modes.end(),
                                      [&, at = at](const Mode& m) { return std::abs(m.p[tip] - at) < apart_px; });
    if (near_one || cost > starts.front().first + 30.0) continue;
    Mode mode{prior.mean, 0.0};
    mode.p[tip] = at;
    modes.push_back(mode);
    if (modes.size() == 3) break;
  }
  for (Mode& mode : modes) mode.cost = problem.descend(mode.p, prior, noise, 12);
  // Starts that ran down the same valley are one.
  std::sort(modes.begin(), modes.end(), [](const Mode& a, const Mode& b) { return a.cost < b.cost; });
  const auto same = [](const Mode& a, const Mode& b) { return std::abs(a.p[tip] - b.p[tip]) < 1.0; };
  for (size_t i = 0; i < modes.size(); ++i)
    modes.erase(std::remove_if(modes.begin() + static_cast<std::ptrdiff_t>(i) + 1, modes.end(),
                               [&](const Mode& m) { return same(modes[i], m); }),
                modes.end());
  const auto best = [&] {
    return std::min_element(modes.begin(), modes.end(), [](const Mode& a, const Mode& b) { return a.cost < b.cost; });
  };
  for (int round = 0; round < 2; ++round) {
    noise = problem.noise_at(best()->p);
    for (Mode& mode : modes) mode.cost = problem.descend(mode.p, prior, noise, round == 0 ? 8 : 4);
  }
  const Mode& found = *best();
  const Vector& p = found.p;
  const auto system = problem.assemble(p, prior, noise, true);
  const Matrix covariance = system.normal.inv(cv::DECOMP_CHOLESKY);
  const auto variance = [&](const Vector& g) { return g.dot(covariance * g); };
  const Problem::Seen seen = problem.seen_with_gradient(p);
  fit.tip.s_px = p[tip];
  fit.tip.s_variance_px2 = covariance(tip, tip);
  const cv::Vec2d further = problem.beyond_model(p, noise, seen.place[0]);
  fit.seen = {seen.place[0] + further[0], variance(seen.by_s) + further[1], seen.place[1], variance(seen.by_across)};
  // Another end that the picture allows nearly as well: as much variance as there is doubt which of the two it is.
  double least_gap = std::numeric_limits<double>::infinity();
  const Mode* second = nullptr;
  for (const Mode& mode : modes) {
    if (std::abs(mode.p[tip] - p[tip]) < 2.0 || mode.cost - found.cost > least_gap) continue;
    least_gap = mode.cost - found.cost;
    second = &mode;
  }
  if (second != nullptr) {
    const double share = std::exp(-least_gap) / (1.0 + std::exp(-least_gap));
    BlurredBevel table;
    table.build(std::exp(second->p[log_bevel]), std::sin(second->p[roll]), priors.blur_px);
    const cv::Vec2d off_seen = problem.seen(second->p, table) - seen.place;
    const double off_tip = second->p[tip] - p[tip];
    fit.tip.s_variance_px2 += share * off_tip * off_tip;
    fit.seen.s_variance_px2 += share * off_seen[0] * off_seen[0];
    fit.seen.across_variance_px2 += share * off_seen[1] * off_seen[1];
  }

  set_axis(problem, p, prior, noise, priors, fit);
  fit.height = p[height];
  fit.base = p[base];
  fit.bevel_px = std::exp(p[log_bevel]);
  fit.roll_rad = p[roll];
  fit.pale = p[pale];
  fit.residual = noise.sigma[0] / p[height];
  fit.correlation_px = noise.correlation_px[0];
  const bool inside = p[tip] > problem.first_s() + 1.0 && p[tip] < problem.last_s() - 1.0;
  fit.converged = inside && p[height] > 0.0 && std::isfinite(fit.tip.s_variance_px2) && fit.tip.s_variance_px2 > 0.0 &&
                  fit.tip.across_variance_px2 > 0.0;
  return fit;
}

}  // namespace bevel::camera
