#include "diagnosis/mismatch/addition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/mismatch/local_unknowns.hpp"

namespace bevel::diagnosis {
namespace {
constexpr int kScans = 4;               // at most
constexpr std::size_t kFineGrid = 20;   // starts
constexpr double kSettled = 0.5;        // chi2
constexpr double kSettledShare = 1e-4;  // of chi2: a fit this far from the readings need not be finished
constexpr double kWorthALook = 20;      // chi2
constexpr double kHopeless = 200;       // chi2
constexpr int kRoughIterations = 8;
constexpr double kRoughTolerance = 0.05;  // chi2
constexpr double kFarOff = 2;             // chi2 per reading: something else is missing first

bool has_local(const Hypothesis& hypothesis) {
  return std::any_of(hypothesis.unknowns().begin(), hypothesis.unknowns().end(),
                     [](const Unknown& u) { return u.recording >= 0; });
}

bool hardly_better(const Fit& again, const Fit& one) {
  return cost_of(again) > cost_of(one) - std::max(kSettled, kSettledShare * cost_of(one));
}

// Where an effect's start is one of a fine grid, its valley is narrow and a linear promise of its size is rough: the
// full model looks around first.
Eigen::VectorXd look_around(const Evidence& evidence, const Hypothesis& hypothesis, std::size_t member,
                            const Eigen::VectorXd& values) {
  const auto& parameters = hypothesis.set()[member].effect->parameters();
  int shape = -1, size = -1;
  double spacing = 0;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const auto& starts = parameters[p].starts;
    if (parameters[p].scope != model::Scope::rig || hypothesis.find(member, p) < 0) continue;
    if (std::isnan(parameters[p].none) && starts.size() >= kFineGrid)
      shape = hypothesis.find(member, p), spacing = starts[1] - starts[0];
    else if (!std::isnan(parameters[p].none))
      size = hypothesis.find(member, p);
  }
  if (shape < 0 || size < 0) return values;
  const Unknown& info = hypothesis.unknowns()[static_cast<std::size_t>(size)];
  const double none = parameters[static_cast<std::size_t>(info.parameter)].none;
  Workspace workspace;
  Eigen::VectorXd best = values;
  double least = std::numeric_limits<double>::infinity();
  for (const double step : {0.0, -0.5, 0.5, -1.0, 1.0})
    for (const double scale : {1.0, 0.5, 1.5, 2.5, 5.0}) {
      Eigen::VectorXd trial = values;
      trial[shape] += step * spacing;
      trial[size] = none + scale * (values[size] - none);
      hypothesis.clamp(trial);
      double chi2 = 0;
      for (std::size_t r = 0; r < evidence.recorded->recordings.size() && chi2 < least; ++r)
        if (evidence.uses(r))
          chi2 += evaluate(evidence, hypothesis, r, trial, false, workspace) ? workspace.residuals.white.squaredNorm()
                                                                             : 1e300;
      if (chi2 < least) least = chi2, best = trial;
    }
  return best;
}

// A fit, its local unknowns scanned and fitted again until that brings nothing more. On the way there no fit is
// finished: at a jump the likelihood has kinks, along which it would creep.
std::shared_ptr<const Fit> settled_fit(const Evidence& evidence, const Hypothesis& hypothesis,
                                       const Eigen::VectorXd& start, const FitRules& rules = {}) {
  if (!has_local(hypothesis)) return std::make_shared<Fit>(fit(evidence, hypothesis, start, rules));
  FitRules rough = rules;
  rough.max_iterations = kRoughIterations;
  rough.tolerance = kRoughTolerance;
  const auto settle = [&](const Eigen::VectorXd& values) {
    auto one = std::make_shared<Fit>(fit_beside_instants(evidence, hypothesis, values, rough));
    for (int scan = 0; scan < kScans && one->valid; ++scan) {
      const auto again = std::make_shared<Fit>(
          fit_beside_instants(evidence, hypothesis, scan_local_unknowns(evidence, hypothesis, one->values), rough));
      const bool settled = !again->valid || hardly_better(*again, *one);
      if (again->valid && cost_of(*again) < cost_of(*one)) one = again;
      if (settled) break;
    }
    return one;
  };
  const auto one = settle(start);
  // What is added may make instants idle that stood for it, and each alone is still worth having: with the strongest.
  const std::size_t half = evidence.recorded->recordings.size() / 2;
  if (!one->valid || static_cast<std::size_t>(instants_in_use(*one)) <= half) return one;
  const auto fewer = settle(scan_local_unknowns(evidence, hypothesis, start, half));
  return fewer->valid && cost_of(*fewer) < cost_of(*one) ? fewer : one;
}

// With the fit finished.
std::shared_ptr<const Fit> finished(const Evidence& evidence, std::shared_ptr<const Fit> rough) {
  if (!has_local(rough->hypothesis)) return rough;
  const auto whole = std::make_shared<Fit>(fit_beside_instants(evidence, rough->hypothesis, rough->values));
  return whole->valid && cost_of(*whole) < cost_of(*rough) ? whole : rough;
}

}  // namespace

std::shared_ptr<const Fit> from_other_sizes(const Evidence& evidence, std::shared_ptr<const Fit> best) {
  const Hypothesis hypothesis = best->hypothesis;
  if (best->chi2 > kFarOff * static_cast<double>(best->count())) return finished(evidence, best);
  for (std::size_t m = 0; m < hypothesis.set().size(); ++m) {
    FitRules rules;
    bool jumps = false;
    for (std::size_t i = kBaseUnknowns; i < hypothesis.unknowns().size(); ++i) {
      const Unknown& unknown = hypothesis.unknowns()[i];
      if (unknown.member != static_cast<int>(m)) continue;
      jumps = jumps || is_instant(hypothesis, unknown);
      if (unknown.recording < 0) rules.held.push_back(static_cast<int>(i));
    }
    for (bool better = jumps; better;) {
      better = false;
      for (const double factor : {0.5, 0.75, 1.33, 2.0}) {
        Eigen::VectorXd values = best->values;
        for (const int i : rules.held) values[i] *= factor;
        const auto held = settled_fit(evidence, hypothesis, scan_local_unknowns(evidence, hypothesis, values), rules);
        if (!held->valid || cost_of(*held) > cost_of(*best) + kHopeless) continue;
        const auto free = settled_fit(evidence, hypothesis, held->values);
        if (!free->valid || hardly_better(*free, *best)) continue;
        best = free;
        better = true;
        break;
      }
    }
  }
  return finished(evidence, best);
}

std::shared_ptr<const Fit> fit_addition(const Evidence& evidence, const Fit& from, const Candidate& candidate,
                                        const std::vector<Promise>& promises) {
  EffectSet set = from.hypothesis.set();
  set.push_back(candidate.member);
  const Hypothesis hypothesis(evidence.belief, set, *evidence.recorded);
  const std::size_t m = set.size() - 1;
  std::shared_ptr<const Fit> best;
  for (const auto& promise : promises) {
    Eigen::VectorXd values = hypothesis.start_from(from.hypothesis, from.values);
    for (std::size_t p = 0; p < promise.parameters.size(); ++p)
      for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
        const int i = hypothesis.find(m, p, static_cast<int>(r));
        if (i < 0) continue;
        const bool local = static_cast<int>(p) == candidate.local && r < promise.local_by_recording.size();
        values[i] = local ? promise.local_by_recording[r] : promise.parameters[p];
      }
    const auto one = settled_fit(evidence, hypothesis, look_around(evidence, hypothesis, m, values));
    if (one->valid && (!best || cost_of(*one) < cost_of(*best) - kSettled)) best = one;
  }
  if (candidate.local_may_be_off && best && cost_of(from) - cost_of(*best) > kWorthALook)
    return from_other_sizes(evidence, best);
  return best ? finished(evidence, best) : best;
}

}  // namespace bevel::diagnosis
