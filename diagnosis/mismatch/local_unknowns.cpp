#include "diagnosis/mismatch/local_unknowns.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace bevel::diagnosis {
namespace {
constexpr double kInstantSpacing_s = 0.3;
constexpr int kFineSteps = 5;  // to each side of the best instant, twice: a jump has no slope to follow
constexpr int kPhases = 12;

// An instant in nearly all recordings is no accident: those that bring least are switched off.
void keep_the_exceptions(std::size_t most_recordings, std::vector<std::pair<double, Eigen::Index>>& brought,
                         Eigen::VectorXd& values) {
  std::sort(brought.begin(), brought.end(), std::greater<>());
  for (std::size_t i = most_recordings; i < brought.size(); ++i) values[brought[i].second] = 0;
}

bool is_instant(const model::EffectParameter& parameter) {
  return parameter.scope == model::Scope::recording && !parameter.periodic && parameter.none == 0;
}

}  // namespace

bool is_instant(const Hypothesis& hypothesis, const Unknown& unknown) {
  return unknown.recording >= 0 && is_instant(hypothesis.set()[static_cast<std::size_t>(unknown.member)]
                                                  .effect->parameters()[static_cast<std::size_t>(unknown.parameter)]);
}

bool has_instants(const Member& member) {
  const auto& parameters = member.effect->parameters();
  for (std::size_t p = 0; p < parameters.size(); ++p)
    if (member.fits(p) && is_instant(parameters[p])) return true;
  return false;
}

Eigen::VectorXd scan_local_unknowns(const Evidence& evidence, const Hypothesis& hypothesis,
                                    const Eigen::VectorXd& values) {
  return scan_local_unknowns(evidence, hypothesis, values,
                             most_recordings_with_an_instant(evidence.recorded->recordings.size()));
}

Eigen::VectorXd scan_local_unknowns(const Evidence& evidence, const Hypothesis& hypothesis,
                                    const Eigen::VectorXd& values, std::size_t most_recordings) {
  Eigen::VectorXd best = values;
  Workspace workspace;
  std::vector<std::pair<double, Eigen::Index>> brought;
  for (std::size_t i = 0; i < hypothesis.unknowns().size(); ++i) {
    const Unknown& unknown = hypothesis.unknowns()[i];
    if (unknown.recording < 0) continue;
    const auto r = static_cast<std::size_t>(unknown.recording);
    const auto column = static_cast<Eigen::Index>(i);
    const bool instant = is_instant(hypothesis, unknown);
    const double span = unknown.upper - unknown.lower;
    const int count = instant ? std::max(4, static_cast<int>(std::lround(span / kInstantSpacing_s))) : kPhases;
    const auto cost_at = [&](double value) {
      Eigen::VectorXd trial = best;
      trial[column] = value;
      if (!evaluate(evidence, hypothesis, r, trial, false, workspace)) return 1e300;
      return workspace.residuals.white.squaredNorm() + (instant && value > 0 ? kInstantCost : 0);
    };
    double value = best[column];
    double least = cost_at(value);
    if (instant && cost_at(0) <= least) least = cost_at(0), value = 0;
    const auto try_at = [&](double candidate) {
      const double cost = cost_at(candidate);
      if (cost < least) least = cost, value = candidate;
    };
    for (int k = 0; k < count; ++k) try_at(unknown.lower + span * (k + 0.5) / count);
    double spacing_s = kInstantSpacing_s;
    for (int finer = 0; finer < 2 && instant && value > 0; ++finer) {
      spacing_s /= kFineSteps;
      const double middle = value;
      for (int k = -kFineSteps; k <= kFineSteps; ++k)
        if (const double at_s = middle + k * spacing_s; at_s > unknown.lower && at_s < unknown.upper) try_at(at_s);
    }
    best[column] = value;
    if (instant && value > 0) brought.emplace_back(cost_at(0) - least, column);
  }
  keep_the_exceptions(most_recordings, brought, best);
  return best;
}

int instants_in_use(const Fit& fit) {
  int count = 0;
  for (std::size_t i = 0; i < fit.hypothesis.unknowns().size(); ++i)
    if (is_instant(fit.hypothesis, fit.hypothesis.unknowns()[i]) && fit.values[static_cast<Eigen::Index>(i)] > 0)
      ++count;
  return count;
}

double cost_of(const Fit& fit) { return fit.penalised + kInstantCost * instants_in_use(fit); }

Fit fit_beside_instants(const Evidence& evidence, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
                        FitRules rules) {
  Fit all = fit(evidence, hypothesis, start, rules);
  bool jumps = false;
  for (std::size_t i = 0; i < hypothesis.unknowns().size(); ++i)
    if (is_instant(hypothesis, hypothesis.unknowns()[i])) rules.held.push_back(static_cast<int>(i)), jumps = true;
  return jumps && all.valid ? fit(evidence, hypothesis, all.values, rules) : all;
}

}  // namespace bevel::diagnosis
