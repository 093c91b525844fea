// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/local_minima.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include <bevel/diagnosis/inference/profile.hpp>
#include <bevel/diagnosis/parallel.hpp>

namespace bevel::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kFiner = 5;
constexpr int kPhases = 12;
constexpr int kScans = 4;
constexpr std::size_t kJumps = 3;        // in a recording, at which an instant is tried
constexpr double kInstantWidth_s = 0.1;  // of an instant's posterior, while it is not known yet
constexpr double kBeyondDoubt = 3;       // times an instant's cost: what the linear model says is lost without it
constexpr std::size_t kGrid = 5;         // starts from which on a parameter is taken to have many local minima
constexpr int kSteps = 10;               // of a scan, to each side
constexpr int kZooms = 2;
constexpr int kWaypoints = 10;  // from one effect to another

// Just before the readings that are least expected from those before them, the worst first: with autocorrelated noise
// any wrong instant costs two such jumps, wherever it is, and a grid goes past the one that costs none.
std::vector<double> before_jumps(const SeriesSet& data, const VectorXd& white, double frame_s) {
  if (white.size() != data.rows()) return {};  // the model has no value there
  std::map<double, double> squares;
  Index row = 0;
  for (const Series& series : data.series)
    for (const double time_s : series.time_s) squares[time_s] += white[row] * white[row], ++row;
  std::vector<std::pair<double, double>> worst;
  for (const auto& [time_s, square] : squares) worst.emplace_back(square, time_s);
  const auto most = std::min(kJumps, worst.size());
  std::partial_sort(worst.begin(), worst.begin() + static_cast<std::ptrdiff_t>(most), worst.end(), std::greater<>());
  std::vector<double> out;
  for (std::size_t i = 0; i < most; ++i) out.push_back(worst[i].second - 0.5 * frame_s);
  return out;
}

// A fit's phases and instants in the recordings from first to last, each at the best of a grid, all else as it is; an
// instant also where the readings jump if it did not happen. As if there were no curve: it may have taken up what they
// are to explain.
std::vector<VectorXd> scanned_local(const Likelihood& likelihood, const Fit& fit, std::size_t first, std::size_t last) {
  const Layout& layout = fit.layout;
  std::vector<VectorXd> local = fit.local;
  for (std::size_t i = 0; i < layout.local().size(); ++i) {
    if (!layout.is_scanned(i)) continue;
    const bool instant = layout.is_instant(i);
    const auto at = static_cast<Index>(i);
    parallel_for(last - first, [&](std::size_t k) {
      const std::size_t r = first + k;
      Residuals residuals;
      const double lower = layout.local()[i].parameter->lower, upper = layout.upper(i, r);
      const double cost = instant ? instant_cost(upper) : 0;
      VectorXd trial = local[r];
      const auto cost_at = [&](double value) {
        trial[at] = value;
        if (!likelihood.evaluate(layout, r, fit.shared, trial, false, residuals))
          return std::numeric_limits<double>::infinity();
        return residuals.white.squaredNorm() + (instant && value > 0 ? cost : 0);
      };
      double best = local[r][at], least = cost_at(best);
      const auto try_at = [&](double value) {
        const double there = cost_at(value);
        if (there < least) least = there, best = value;
      };
      if (instant) {
        try_at(0);
        // The residuals are those of what was tried last.
        for (const double at_s :
             before_jumps(likelihood.data().recordings[r], residuals.white, likelihood.data().frame_s))
          if (at_s > lower && at_s < upper) try_at(at_s);
      }
      const int count = instant ? instants_of(upper - lower) : kPhases;
      for (int j = 0; j < count; ++j) try_at(lower + (upper - lower) * (j + 0.5) / count);
      double spacing_s = kInstantSpacing_s;
      for (int finer = 0; finer < 2 && instant && best > 0; ++finer) {
        spacing_s /= kFiner;
        const double middle = best;
        for (int j = -kFiner; j <= kFiner; ++j)
          if (const double at_s = middle + j * spacing_s; at_s > lower && at_s < upper) try_at(at_s);
      }
      local[r][at] = best;
    });
  }
  return local;
}

// The fit from there. Not valid where nothing is found elsewhere.
Fit scanned(const Likelihood& likelihood, const CurveColumns& curve, const Fit& from, std::size_t first,
            std::size_t last) {
  const auto local = scanned_local(likelihood, from, first, last);
  if (local == from.local) return Fit(from.layout);
  return fit(likelihood, from.layout, from.shared, local, from.scales, curve);
}

}  // namespace

double instant_cost(double duration_s) { return 2 * std::log(kHappensNot / kHappens * duration_s / kInstantWidth_s); }

double cost_with_instants(const Fit& fit) {
  double sum = fit.cost;
  for (std::size_t i = 0; i < fit.layout.local().size(); ++i) {
    if (!fit.layout.is_instant(i)) continue;
    for (std::size_t r = 0; r < fit.local.size(); ++r)
      if (fit.local[r][static_cast<Index>(i)] > 0) sum += instant_cost(fit.layout.upper(i, r));
  }
  return sum;
}

int instants_of(double duration_s) {
  return std::max(4, static_cast<int>(std::lround(duration_s / kInstantSpacing_s)));
}

bool has_scanned(const Layout& layout) { return layout.local().size() > layout.system().nuisances().size(); }

double grid_spacing(const Parameter& p, double value) {
  auto starts = p.starts;
  std::sort(starts.begin(), starts.end());
  const auto above = std::lower_bound(starts.begin(), starts.end(), value);
  const auto upper = above == starts.end() ? above - 1 : (above == starts.begin() ? above + 1 : above);
  return *upper - *(upper - 1);
}

bool has_many_minima(const Parameter& parameter) {
  return (std::isnan(parameter.none) || parameter.shape) && parameter.starts.size() >= kGrid && !parameter.periodic;
}

void scan_locals(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted) {
  for (int scan = 0; scan < kScans && has_scanned(fitted.layout); ++scan) {
    Fit again = scanned(likelihood, curve, fitted, 0, fitted.local.size());
    if (!again.valid || !(cost_with_instants(again) < cost_with_instants(fitted))) return;
    fitted = std::move(again);
  }
}

namespace {

// By the linear model, all else following: the rise in cost where an instant did not happen in a recording.
double rise_without(const Likelihood& likelihood, const CurveColumns& curve, const Fit& fitted,
                    std::vector<ArrowBlock> blocks, std::size_t r, Index instant) {
  Fit off = fitted;
  off.local[r][instant] = 0;
  LinearRecording there;
  if (blocks.empty() || !linearise(likelihood, off, curve, r, there)) return 0;
  blocks[r] = std::move(there.block);
  const ArrowSolution solution = solve_about(off, blocks, curve, std::vector<Index>{});
  return solution.valid ? solution.least - fitted.cost : 0;
}

}  // namespace

void doubt_instants(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted) {
  const Layout& layout = fitted.layout;
  std::vector<ArrowBlock> blocks;
  for (std::size_t i = 0; i < layout.local().size(); ++i) {
    if (!layout.is_instant(i)) continue;
    for (std::size_t r = 0; r < fitted.local.size(); ++r) {
      if (!(fitted.local[r][static_cast<Index>(i)] > 0)) continue;
      const double cost = instant_cost(layout.upper(i, r));
      if (blocks.empty()) blocks = linearise(likelihood, fitted, curve);
      if (rise_without(likelihood, curve, fitted, blocks, r, static_cast<Index>(i)) > kBeyondDoubt * cost) continue;
      auto local = fitted.local;
      local[r][static_cast<Index>(i)] = 0;
      Fit without = fit(likelihood, layout, fitted.shared, local, fitted.scales, curve);
      if (!without.valid) continue;
      Fit again = scanned(likelihood, curve, without, r, r + 1);
      if (!again.valid) again = std::move(without);  // nor is it anywhere else
      if (cost_with_instants(again) < cost_with_instants(fitted)) fitted = std::move(again), blocks.clear();
    }
  }
}

bool has_jump(const Layout& layout, int member) {
  for (std::size_t i = 0; i < layout.local().size(); ++i)
    if (!layout.is_fitted(i) && layout.local()[i].member == member) return true;
  return false;
}

namespace {

// The least cost of a fit's linear model with one parameter `step` by `step` away, to each side; the fit from there
// where that costs less.
void scan_about(const Likelihood& likelihood, const CurveColumns& curve, Index which, double step, Fit& fitted) {
  const Parameter& p = *fitted.layout.shared()[static_cast<std::size_t>(which)].parameter;
  const Profile profile(likelihood, curve, fitted);
  if (!profile.valid()) return;
  VectorXd best_shared;
  std::vector<VectorXd> best_local;
  double least = fitted.cost;
  for (const double direction : {-1.0, 1.0}) {
    VectorXd shared = fitted.shared;
    std::vector<VectorXd> local = fitted.local;
    for (int k = 1; k <= kSteps; ++k) {
      const double value = fitted.shared[which] + direction * k * step;
      if (value < p.lower || value > p.upper) break;
      const double cost = profile.following_instants(which, value, shared, local);
      if (cost < least) least = cost, best_shared = shared, best_local = local;
    }
  }
  if (best_local.empty()) return;
  Fit again = fit(likelihood, fitted.layout, best_shared, best_local, fitted.scales, curve);
  if (again.valid && again.cost < fitted.cost) fitted = std::move(again);
}

// What comes again after a length comes again after twice of it: at half the length every second place is right. The
// others first, with the length held, then all.
void try_multiples(const Likelihood& likelihood, const CurveColumns& curve, Index which, Fit& fitted) {
  const Parameter& p = *fitted.layout.shared()[static_cast<std::size_t>(which)].parameter;
  const Fit from = fitted;
  for (const double factor : {0.5, 2.0}) {
    VectorXd shared = from.shared;
    shared[which] = std::clamp(factor * shared[which], p.lower, p.upper);
    const Fit held = fit(likelihood, from.layout, shared, from.local, from.scales, curve, {.fixed = {which}});
    if (!held.valid) continue;
    Fit again = fit(likelihood, from.layout, held.shared, held.local, from.scales, curve);
    if (again.valid && again.cost < fitted.cost) fitted = std::move(again);
  }
}

}  // namespace

void scan_shapes(const Likelihood& likelihood, const CurveColumns& curve, Fit& fitted) {
  for (std::size_t i = 0; i < fitted.layout.shared().size(); ++i) {
    const Parameter& p = *fitted.layout.shared()[i].parameter;
    const auto which = static_cast<Index>(i);
    if (!has_many_minima(p)) continue;
    if (p.shape) try_multiples(likelihood, curve, which, fitted);
    double step = grid_spacing(p, fitted.shared[which]) / kSteps;
    for (int zoom = 0; zoom < kZooms; ++zoom, step /= kSteps) scan_about(likelihood, curve, which, step, fitted);
  }
}

Fit replaced(const Likelihood& likelihood, const CurveColumns& curve, const Fit& from, std::size_t member,
             std::size_t effect, const VectorXd& start) {
  const System& system = from.layout.system();
  const std::size_t leaving = from.layout.set()[member];
  const Layout both(system, with(from.layout.set(), effect));
  const auto place = [&](std::size_t one) {
    return static_cast<std::size_t>(std::ranges::find(both.set(), one) - both.set().begin());
  };
  Fit now = carried_to(both, from);
  const auto& joining = system.effects()[effect].parameters;
  Index next = 0;
  for (std::size_t p = 0; p < joining.size(); ++p)
    if (const int i = both.find_shared(place(effect), p); i >= 0) {
      if (!is_size(joining[p])) now.shared[i] = start[next];
      ++next;
    }
  FitRules rules{.tolerance = 0.5};
  const auto& parameters = system.effects()[leaving].parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    if (const int i = both.find_shared(place(leaving), p); i >= 0) rules.fixed.push_back(i);
  const VectorXd at_first = now.shared;
  for (int k = 1; k <= kWaypoints; ++k) {
    const double left = 1 - static_cast<double>(k) / kWaypoints;
    for (std::size_t p = 0; p < parameters.size(); ++p)
      if (const int i = both.find_shared(place(leaving), p); i >= 0 && is_size(parameters[p]))
        now.shared[i] = parameters[p].none + left * (at_first[i] - parameters[p].none);
    now = fit(likelihood, both, now.shared, now.local, now.scales, curve, rules);
    if (!now.valid) break;
  }
  return carried_to(Layout(system, with(without(from.layout.set(), leaving), effect)), now);
}

std::vector<double> log_costs_of_dropping(const Fit& fit, const CurveColumns& curve) {
  const ModelSet& set = fit.layout.set();
  std::vector<double> out(set.size(), std::numeric_limits<double>::infinity());
  const auto blocks = linearise(*fit.likelihood, fit, curve);
  for (std::size_t m = 0; m < set.size() && !blocks.empty(); ++m) {
    const auto& parameters = fit.layout.system().effects()[set[m]].parameters;
    std::vector<Index> sizes;
    std::vector<double> apart;
    bool held = false;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if (parameters[p].scope != Scope::shared || !is_size(parameters[p])) continue;
      sizes.push_back(fit.layout.find_shared(m, p));
      apart.push_back(fit.shared[sizes.back()] - parameters[p].none);
      held = held || std::ranges::count(fit.held, sizes.back()) > 0;
    }
    if (sizes.empty()) continue;
    const auto d = Eigen::Map<const VectorXd>(apart.data(), static_cast<Index>(apart.size()));
    if (d.isZero(0)) {
      out[m] = 0;
      continue;
    }
    if (held) continue;
    const ArrowSolution solution = solve_about(fit, blocks, curve, sizes);
    if (!solution.valid) continue;
    out[m] = 0.5 * d.dot(solution.covariance(sizes, sizes).ldlt().solve(d));
  }
  return out;
}

}  // namespace bevel::inference
