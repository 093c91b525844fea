#include "diagnosis/mismatch/intervals.hpp"

#include <algorithm>
#include <cmath>

namespace bevel::diagnosis {
namespace {

constexpr double kRise95 = 3.841;
constexpr double kStandard95 = 1.96;
constexpr int kSteps = 12;
constexpr double kInstantSpacing_s = 0.04;

}  // namespace

FoundParameter profile(const Evidence& evidence, const Fit& best, int unknown, const std::string& name) {
  const Unknown& info = best.hypothesis.unknowns()[static_cast<std::size_t>(unknown)];
  FoundParameter out;
  out.name = name;
  out.value = best.values[unknown];
  const double variance = best.covariance()(unknown, unknown);
  const double guess = variance > 0 ? std::sqrt(variance) : 0.1 * std::max(std::abs(out.value), 1e-3);
  FitRules rules;
  rules.held = {unknown};
  rules.tolerance = 0.01;
  const auto rise_at = [&](double value, Eigen::VectorXd& from) {
    // An angle past its bounds turns others with it: each time from where they belong together.
    Eigen::VectorXd values = info.periodic ? best.values : from;
    values[unknown] = value;
    const Fit there = fit(evidence, best.hypothesis, values, rules);
    if (!there.valid) return 1e6;
    from = there.values;
    return there.penalised - best.penalised;
  };
  std::array<double, 2> ends{};
  for (int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? -1 : 1;
    const double bound =
        info.periodic ? out.value + sign * 0.5 * (info.upper - info.lower) : (side == 0 ? info.lower : info.upper);
    // Out to where the rise is passed, then a secant on its square root, which is near linear.
    double inside = 0, rise_inside = 0, outside = kStandard95 * guess;
    Eigen::VectorXd values = best.values;
    double end = bound;
    for (int step = 0; step < kSteps; ++step) {
      const bool past_bound = outside >= sign * (bound - out.value);
      const double at = past_bound ? sign * (bound - out.value) : outside;
      const double rise = rise_at(out.value + sign * at, values);
      if (std::abs(rise - kRise95) < 0.1) {
        end = out.value + sign * at;
        break;
      }
      if (rise < kRise95) {
        inside = at, rise_inside = std::max(rise, 0.0);
        if (past_bound) {
          end = bound;
          break;
        }
        outside = at * std::clamp(std::sqrt(kRise95 / std::max(rise, 0.2)), 1.05, 4.0);
      } else {
        const double share = (std::sqrt(kRise95) - std::sqrt(rise_inside)) / (std::sqrt(rise) - std::sqrt(rise_inside));
        outside = inside + (at - inside) * std::clamp(share, 0.1, 0.95);
        values = best.values;
      }
      end = out.value + sign * outside;
    }
    ends[static_cast<std::size_t>(side)] = end;
  }
  out.ci95 = ends;
  out.at_bound = !info.periodic && (out.value <= info.lower || out.value >= info.upper);
  // Of the interval, so that a lopsided likelihood does not look surer than it is.
  out.std_error = variance > 0 && !out.at_bound ? std::max(std::sqrt(variance), (ends[1] - ends[0]) / (2 * kStandard95))
                                                : (ends[1] - ends[0]) / (2 * kStandard95);
  return out;
}

FoundParameter profile_instant(const Evidence& evidence, const Fit& best, int unknown, const std::string& name) {
  const Unknown& info = best.hypothesis.unknowns()[static_cast<std::size_t>(unknown)];
  const auto r = static_cast<std::size_t>(info.recording);
  FoundParameter out;
  out.name = name;
  out.value = best.values[unknown];
  Workspace workspace;
  Eigen::VectorXd values = best.values;
  const auto chi2_at = [&](double at_s) {
    values[unknown] = at_s;
    return evaluate(evidence, best.hypothesis, r, values, false, workspace) ? workspace.residuals.white.squaredNorm()
                                                                            : 1e300;
  };
  const double least = chi2_at(out.value);
  out.ci95 = {out.value, out.value};
  for (int side = 0; side < 2; ++side) {
    const double step_s = side == 0 ? -kInstantSpacing_s : kInstantSpacing_s;
    // Out to the first step that is worse: a jump is placed better than that only by its assumed form.
    double at_s = out.value;
    double rise = 0;
    while (rise <= kRise95 && at_s + step_s > info.lower && at_s + step_s < info.upper) {
      at_s += step_s;
      rise = chi2_at(at_s) - least;
    }
    out.ci95[static_cast<std::size_t>(side)] = at_s;
  }
  out.std_error = std::max((out.ci95[1] - out.ci95[0]) / (2 * kStandard95), kInstantSpacing_s / 2);
  out.value = 0.5 * (out.ci95[0] + out.ci95[1]);
  return out;
}

}  // namespace bevel::diagnosis
