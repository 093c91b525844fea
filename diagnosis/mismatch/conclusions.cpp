#include "diagnosis/mismatch/conclusions.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "diagnosis/mismatch/experiments.hpp"
#include "diagnosis/mismatch/gates.hpp"
#include "diagnosis/mismatch/intervals.hpp"
#include "diagnosis/mismatch/local_unknowns.hpp"
#include "diagnosis/mismatch/parallel.hpp"

namespace bevel::diagnosis {
namespace {

constexpr double kRivalEvidence = 6.0;  // odds of 20 to 1
constexpr double kCloseEvidence = 9.2;  // odds of 100 to 1, for effects of nearly one signature
constexpr double kUnexplainedSigmas = 6;
constexpr double kSameSignature = 0.95;  // cosine of visible parts

std::string label_of(const Member& member) {
  const auto& effect = *member.effect;
  std::string label(effect.name());
  if (effect.variants().size() > 1)
    for (std::size_t p = 0; p < effect.parameters().size(); ++p)
      if (member.fits(p) && effect.parameters()[p].scope == model::Scope::rig)
        label += " (" + std::string(effect.parameters()[p].name.substr(0, effect.parameters()[p].name.find('_'))) + ")";
  return label;
}

NeedleEstimate estimate_of(const Fit& fit) {
  NeedleEstimate out;
  out.value = fit.hypothesis.needle(fit.values);
  const Eigen::MatrixXd covariance = fit.covariance();
  const Eigen::RowVector2d by(1, out.value.lambda2 / std::numbers::pi);  // lambda1 by (u, lambda2)
  out.curvature_sd_per_mm = std::sqrt(covariance(kUnknownK, kUnknownK));
  out.lambda1_sd_per_rad = std::sqrt((by * covariance.block<2, 2>(kUnknownU, kUnknownU) * by.transpose()).value());
  out.lambda2_sd = std::sqrt(covariance(kUnknownLambda2, kUnknownLambda2));
  return out;
}

TriedEffect tried_of(const Trial& trial, const EffectSet& beside) {
  const Member& member = trial.set.back();
  TriedEffect out{.name = label_of(member),
                  .beside = beside.empty() ? "" : describe(beside),
                  .gain = trial.gain,
                  .chance = trial.chance,
                  .threshold = trial.limit(),
                  .evidence = trial.preference,
                  .parameters = {},
                  .passes = trial.passes()};
  const auto& parameters = member.effect->parameters();
  for (std::size_t p = 0; p < parameters.size(); ++p)
    if (member.fits(p) && parameters[p].scope == model::Scope::rig)
      out.parameters.emplace_back(parameters[p].name,
                                  trial.fit->hypothesis.parameter(trial.fit->values, trial.set.size() - 1, p));
  return out;
}

std::vector<TriedEffect> tried_beside(Selection& selection, const EffectSet& set) {
  std::vector<TriedEffect> out;
  for (const Trial& trial : selection.additions(set)) out.push_back(tried_of(trial, set));
  return out;
}

// The effect's parameters with intervals, and its instants and phases per recording.
void find_parameters(const Evidence& evidence, const Fit& fit, std::size_t member, FoundEffect& found, int threads) {
  const auto& hypothesis = fit.hypothesis;
  const auto& parameters = hypothesis.set()[member].effect->parameters();
  std::vector<std::pair<std::size_t, int>> shared;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    if (parameters[p].scope == model::Scope::rig && hypothesis.find(member, p) >= 0)
      shared.emplace_back(p, hypothesis.find(member, p));
  found.parameters.resize(shared.size());
  parallel_for(shared.size(), threads, [&](std::size_t i) {
    found.parameters[i] = profile(evidence, fit, shared[i].second, std::string(parameters[shared[i].first].name));
  });
  const Eigen::MatrixXd covariance = fit.covariance();
  for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
    FoundInRecording one;
    one.log = evidence.recorded->recordings[r].name;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      const int i = hypothesis.find(member, p, static_cast<int>(r));
      if (parameters[p].scope != model::Scope::recording || i < 0) continue;
      const double value = fit.values[i];
      if (!parameters[p].periodic && value == 0) continue;  // not in this recording
      const double sd = std::sqrt(covariance(i, i));
      const std::string name(parameters[p].name);
      if (parameters[p].periodic)
        one.parameters.push_back({name, value, sd, {value - 1.96 * sd, value + 1.96 * sd}, false});
      else
        one.parameters.push_back(profile_instant(evidence, fit, i, name));
    }
    if (!one.parameters.empty()) found.recordings.push_back(one);
  }
}

FoundEffect find_effect_of(Selection& selection, const EffectSet& set, std::size_t member, int threads) {
  const Fit& fit = *selection.fit_of(set);
  const EffectSet rest = without_member(set, member);
  const Fit& without = *selection.fit_of(rest);
  FoundEffect found;
  found.name = set[member].effect->name();
  found.meaning = set[member].effect->meaning();
  found.probability = probability_of(selection.visited(), set[member]);
  found.gain = cost_of(without) - cost_of(fit);
  found.visible_sigmas = std::sqrt(std::max(0.0, found.gain));
  for (const Trial& trial : selection.additions(rest))
    if (trial.set.back() == set[member]) found.threshold = trial.limit();
  std::size_t in_fit = 0;
  while (!(fit.hypothesis.set()[in_fit] == set[member])) ++in_fit;
  find_parameters(selection.evidence(), fit, in_fit, found, threads);
  return found;
}

double deepest_mm(const RecordedCase& recorded) {
  double depth = 0;
  for (const auto& recording : recorded.recordings)
    for (const auto& node : recording.motion.nodes) depth = std::max(depth, node.insertion_mm);
  return depth;
}

// The base with one effect at a typical size, as if it were fitted.
Fit imagined(Selection& selection, const Candidate& candidate, const Fit& base) {
  const Hypothesis hypothesis(selection.evidence().belief, {candidate.member}, *selection.evidence().recorded);
  Fit fit(hypothesis);
  fit.values = hypothesis.start_from(base.hypothesis, base.values);
  const auto& shape = candidate.signatures[candidate.signatures.size() / 2].shape;
  for (std::size_t p = 0; p < shape.size(); ++p)
    if (const int i = hypothesis.find(0, p); i >= 0) fit.values[i] = shape[p];
  if (candidate.local >= 0 && candidate.local_may_be_off)
    for (std::size_t r = 0; r < selection.evidence().recorded->recordings.size(); ++r)
      if (const int i = hypothesis.find(0, static_cast<std::size_t>(candidate.local), static_cast<int>(r)); i >= 0)
        fit.values[i] = 2.0;
  return fit;
}

void find_detectable(Selection& selection, const Fit& base, Findings& findings) {
  const double depth_mm = deepest_mm(*selection.evidence().recorded);
  for (const Candidate& candidate : selection.dictionary()) {
    const auto& parameters = candidate.member.effect->parameters();
    if (candidate.signatures.empty()) continue;
    for (std::size_t a = 0; a < candidate.amplitudes.size(); ++a) {
      const auto p = static_cast<std::size_t>(candidate.amplitudes[a]);
      const double visible = visible_per_unit(candidate, a);
      DetectableSize one{
          .effect = std::string(candidate.member.effect->name()),
          .parameter = std::string(parameters[p].name),
          .size = visible > 0 ? kVisibleSigmas / visible : std::numeric_limits<double>::infinity(),
          .typical = std::abs(parameters[p].starts[parameters[p].starts.size() / 2] - parameters[p].none),
          .absorbed = absorbed_share(candidate),
          .experiment = ""};
      if (!(one.size < one.typical))
        one.experiment =
            best_experiment(selection.evidence(), imagined(selection, candidate, base), base, depth_mm).script;
      findings.detectable.push_back(one);
    }
  }
}

void find_confusion(Selection& selection, Findings& findings) {
  std::vector<Eigen::MatrixXd> bases;
  for (const Candidate& candidate : selection.dictionary()) {
    if (candidate.signatures.empty()) continue;
    Eigen::MatrixXd basis = visible_basis(candidate, selection.ground());
    if (basis.cols() == 0) continue;
    findings.confusion_names.push_back(label_of(candidate.member));
    bases.push_back(std::move(basis));
  }
  const auto n = static_cast<Eigen::Index>(bases.size());
  findings.confusion.setIdentity(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < i; ++j) {
      const Eigen::MatrixXd product =
          bases[static_cast<std::size_t>(i)].transpose() * bases[static_cast<std::size_t>(j)];
      const double cosine = Eigen::JacobiSVD<Eigen::MatrixXd>(product).singularValues()[0];
      findings.confusion(i, j) = findings.confusion(j, i) = std::min(cosine, 1.0);
    }
}

double confusion_between(const Findings& findings, const std::string& a, const std::string& b) {
  double largest = 0;
  for (std::size_t i = 0; i < findings.confusion_names.size(); ++i)
    for (std::size_t j = 0; j < findings.confusion_names.size(); ++j)
      if (findings.confusion_names[i].starts_with(a) && findings.confusion_names[j].starts_with(b))
        largest = std::max(largest, findings.confusion(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
  return largest;
}

// Effects that explain as much in its place, or nearly, where the two look alike in these recordings.
std::vector<std::string> rivals_of(Selection& selection, const EffectSet& set, std::size_t member,
                                   const Findings& findings) {
  std::set<std::string> names;
  const std::string mine(set[member].effect->name());
  for (const Trial& trial : selection.additions(without_member(set, member))) {
    const std::string other(trial.set.back().effect->name());
    const double behind = selection.preference_of(set) - trial.preference;
    const bool alike = confusion_between(findings, mine, other) > kSameSignature;
    if (other != mine && behind < (alike ? kCloseEvidence : kRivalEvidence)) names.insert(other);
  }
  return {names.begin(), names.end()};
}

// What comes nearest to the verdict: the set to tell it from.
const Trial* nearest_rival(Selection& selection, const EffectSet& set) {
  const auto& trials = selection.additions(set.empty() ? EffectSet{} : without_member(set, set.size() - 1));
  for (const Trial& trial : trials)
    if (key_of(trial.set) != key_of(set)) return &trial;
  return nullptr;
}

void find_sentence(Findings& findings) {
  const auto list = [&] {
    std::string text;
    for (std::size_t i = 0; i < findings.effects.size(); ++i)
      text += (i == 0                             ? ""
               : i + 1 == findings.effects.size() ? " and "
                                                  : ", ") +
              findings.effects[i].name + " (" + findings.effects[i].meaning + ")";
    return text;
  };
  switch (findings.verdict) {
    case Verdict::nothing_missing:
      findings.sentence = "Nothing is missing from the model that these recordings could show.";
      break;
    case Verdict::effects_found:
      findings.sentence = "The model leaves out " + list() + ".";
      break;
    case Verdict::unknown_effect:
      findings.sentence =
          "Something is missing that no effect of the library explains: the " +
          (findings.corrections.empty()
               ? std::string("tip is off in a way that no curve of one covariate describes")
               : findings.corrections.front().component + " is off with " + findings.corrections.front().covariate) +
          (findings.effects.empty() ? "." : ", beside " + list() + ".");
      break;
  }
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::nothing_missing:
      return "nothing-missing";
    case Verdict::effects_found:
      return "effects-found";
    case Verdict::unknown_effect:
      return "unknown-effect";
  }
  return "unknown-effect";
}

double probability_of(const std::vector<std::pair<EffectSet, double>>& visited, const Member& member) {
  const auto score = [](const auto& one) { return 0.5 * one.second; };
  double best = -std::numeric_limits<double>::infinity();
  for (const auto& one : visited) best = std::max(best, score(one));
  double with = 0, all = 0;
  for (const auto& one : visited) {
    const double weight = std::exp(score(one) - best);
    all += weight;
    if (std::any_of(one.first.begin(), one.first.end(), [&](const Member& m) { return m.effect == member.effect; }))
      with += weight;
  }
  return with / all;
}

void conclude(Selection& selection, const Fit& base, const EffectSet& set, Findings& findings, int threads) {
  const std::shared_ptr<const Fit> fit = selection.fit_of(set);
  findings.base = estimate_of(base);
  findings.needle = estimate_of(*fit);
  findings.verdict = set.empty() ? Verdict::nothing_missing : Verdict::effects_found;
  findings.tried = tried_beside(selection, {});
  find_confusion(selection, findings);
  for (std::size_t m = 0; m < set.size(); ++m) {
    if (is_correction(set[m])) {
      findings.verdict = Verdict::unknown_effect;
      Correction correction = selection.describe_correction(set, m);
      findings.corrections.push_back(std::move(correction));
      continue;
    }
    FoundEffect found = find_effect_of(selection, set, m, threads);
    found.ambiguous_with = rivals_of(selection, set, m, findings);
    if (found.gain < found.threshold)
      findings.remarks.push_back(found.name +
                                 " is not certain by itself: that something is missing is shown by a nameless curve, "
                                 "which it explains nearly as well");
    for (const FoundParameter& parameter : found.parameters)
      if (parameter.at_bound)
        findings.remarks.push_back(found.name + ": " + parameter.name +
                                   " lies at the end of the range that fits allow; it is a limit, not a measurement");
    findings.effects.push_back(std::move(found));
  }
  const Remains remains = examine_remains(selection.evidence(), *fit);
  auto& checks = findings.checks;
  checks.chi2_per_dof = remains.chi2_per_dof;
  checks.band = remains.band;
  checks.ljung_box_p = remains.ljung_box_p;
  checks.remaining_sigmas = remains.structure_sigmas;
  const double explained = std::max(0.0, base.penalised - fit->penalised);
  const double left = std::max(0.0, remains.structure_energy);
  checks.unexplained_share = explained + left > 0 ? left / (explained + left) : 0;
  checks.clean = remains.is_noise();
  // Whatever has a name or a curve: what leaves this much structure, slow or quick, is not explained.
  if (remains.structure_sigmas > kUnexplainedSigmas || remains.ljung_box_p < kStructureChance)
    findings.verdict = Verdict::unknown_effect;

  if (!set.empty() && findings.corrections.empty()) findings.beside = tried_beside(selection, set);
  find_detectable(selection, base, findings);

  const double depth_mm = deepest_mm(*selection.evidence().recorded);
  if (findings.verdict == Verdict::unknown_effect) {
    if (const Trial* named = nearest_rival(selection, {}))
      findings.next_experiment = best_experiment(selection.evidence(), *fit, *named->fit, depth_mm);
  } else if (const Trial* rival = nearest_rival(selection, set)) {
    findings.next_experiment = set.empty() ? best_experiment(selection.evidence(), *rival->fit, base, depth_mm)
                                           : best_experiment(selection.evidence(), *fit, *rival->fit, depth_mm);
  }
  find_sentence(findings);
}

}  // namespace bevel::diagnosis
