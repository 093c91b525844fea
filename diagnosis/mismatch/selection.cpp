#include "diagnosis/mismatch/selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/mismatch/gates.hpp"
#include "diagnosis/mismatch/local_unknowns.hpp"
#include "diagnosis/mismatch/parallel.hpp"

namespace bevel::diagnosis {
namespace {
constexpr int kScans = 2;
constexpr std::size_t kFineGrid = 20;    // starts
constexpr double kLittle = 6.0;          // chi2
constexpr double kSettled = 0.5;         // chi2
constexpr double kCorrectionChance = 4;  // mean gain of a correction of four knots under noise
constexpr std::size_t kCorrectionsFitted = 3;
constexpr int kLargestCorrections = 2;

bool has_local(const Hypothesis& hypothesis) {
  return std::any_of(hypothesis.unknowns().begin(), hypothesis.unknowns().end(),
                     [](const Unknown& u) { return u.recording >= 0; });
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

std::string member_key(const Member& member) {
  return std::string(member.effect->name()) + "/" + std::to_string(member.variant);
}
}  // namespace

std::string key_of(const EffectSet& set) {
  std::vector<std::string> names;
  for (const auto& member : set) names.push_back(member_key(member));
  std::sort(names.begin(), names.end());
  std::string key;
  for (const auto& name : names) key += name + ";";
  return key;
}

EffectSet without_member(const EffectSet& set, std::size_t index) {
  EffectSet rest = set;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(index));
  return rest;
}

std::shared_ptr<const Fit> fit_addition(const Evidence& evidence, const Fit& from, const Candidate& candidate,
                                        const std::vector<Promise>& promises) {
  EffectSet set = from.hypothesis.set();
  set.push_back(candidate.member);
  const Hypothesis hypothesis(evidence.belief, set, *evidence.recorded);
  const std::size_t m = set.size() - 1;
  std::shared_ptr<Fit> best;
  for (const auto& promise : promises) {
    Eigen::VectorXd values = hypothesis.start_from(from.hypothesis, from.values);
    for (std::size_t p = 0; p < promise.parameters.size(); ++p)
      for (std::size_t r = 0; r < evidence.recorded->recordings.size(); ++r) {
        const int i = hypothesis.find(m, p, static_cast<int>(r));
        if (i < 0) continue;
        const bool local = static_cast<int>(p) == candidate.local && r < promise.local_by_recording.size();
        values[i] = local ? promise.local_by_recording[r] : promise.parameters[p];
      }
    values = look_around(evidence, hypothesis, m, values);
    auto one = std::make_shared<Fit>(fit(evidence, hypothesis, values));
    for (int scan = 0; scan < kScans && one->valid && has_local(hypothesis); ++scan) {
      auto again =
          std::make_shared<Fit>(fit(evidence, hypothesis, scan_local_unknowns(evidence, hypothesis, one->values)));
      const auto cost = [](const Fit& f) { return f.penalised + kInstantCost * instants_in_use(f); };
      const bool better = again->valid && cost(*again) < cost(*one);
      const bool settled = cost(*again) > cost(*one) - kSettled;
      if (better) one = again;
      if (settled) break;
    }
    if (one->valid && (!best || one->penalised < best->penalised)) best = one;
  }
  return best;
}

Selection::Selection(const Evidence& evidence, const Fit& base, const SelectionRules& rules, Progress progress)
    : evidence_(evidence), rules_(rules), progress_(std::move(progress)), corrections_(*evidence.recorded) {
  known_[key_of({})] = {{}, std::make_shared<Fit>(base), 0};
  ground_ = make_ground(evidence_, base);
  dictionary_ = make_dictionary(evidence_, base, ground_, members_of_library({}), rules_.threads);
  null_gains_ = bootstrap_null(dictionary_, ground_, rules_.bootstrap_draws, rules_.seed, rules_.threads);
  for (std::size_t e = 0; e < dictionary_.size(); ++e) chance_[member_key(dictionary_[e].member)] = null_gains_.mean[e];
}

const NullGains& Selection::null_gains() { return null_gains_; }
const std::vector<Candidate>& Selection::dictionary() { return dictionary_; }
const Ground& Selection::ground() { return ground_; }

void Selection::say(const std::string& text) const {
  if (progress_) progress_(text);
}

Selection::Known& Selection::known(const EffectSet& set) {
  const std::string key = key_of(set);
  if (const auto at = known_.find(key); at != known_.end()) return at->second;
  // Not fitted on the way here: from a part that was.
  std::size_t last = set.size() - 1;
  for (std::size_t m = 0; m < set.size(); ++m)
    if (known_.contains(key_of(without_member(set, m)))) last = m;
  const Known part = known(without_member(set, last));
  const Ground ground = make_ground(evidence_, *part.fit);
  const auto dictionary = make_dictionary(evidence_, *part.fit, ground, {set[last]}, rules_.threads);
  const auto fit =
      fit_addition(evidence_, *part.fit, dictionary[0], best_promises(dictionary[0], ground, rules_.starts_fitted));
  // A set that cannot be fitted is worth no more than its part.
  if (!fit) return known_[key] = {part.set, part.fit, part.evidence};
  const double base = known_.at(key_of({})).fit->penalised;
  return known_[key] = {set, fit, base - fit->penalised - cost_of(set, *fit)};
}

std::shared_ptr<const Fit> Selection::fit_of(const EffectSet& set) { return known(set).fit; }
double Selection::evidence_of(const EffectSet& set) { return known(set).evidence; }

double Selection::cost_of(const EffectSet& set, const Fit& fit) {
  double cost = kInstantCost * instants_in_use(fit);
  for (const auto& member : set) cost += is_correction(member) ? kCorrectionChance : chance_[member_key(member)];
  return cost;
}

const std::vector<Trial>& Selection::additions(const EffectSet& to) {
  const std::string key = key_of(to);
  if (const auto at = additions_.find(key); at != additions_.end()) return at->second;
  const std::shared_ptr<const Fit> from = known(to).fit;
  const double base = known_.at(key_of({})).fit->penalised;
  Ground ground;
  std::vector<Candidate> dictionary;
  NullGains chance;
  const bool first = to.empty();
  if (!first) {
    ground = make_ground(evidence_, *from);
    dictionary = make_dictionary(evidence_, *from, ground, members_of_library(to), rules_.threads);
    chance = bootstrap_null(dictionary, ground, rules_.bootstrap_draws, rules_.seed, rules_.threads);
  }
  const Ground& g = first ? ground_ : ground;
  const auto& candidates = first ? dictionary_ : dictionary;
  const NullGains& null_gains = first ? null_gains_ : chance;
  std::vector<Trial> trials(candidates.size());
  parallel_for(candidates.size(), rules_.threads, [&](std::size_t e) {
    Trial& trial = trials[e];
    trial.set = to;
    trial.set.push_back(candidates[e].member);
    trial.chance = null_gains.mean[e];
    trial.threshold = null_gains.threshold[e];
    trial.fit = fit_addition(evidence_, *from, candidates[e], best_promises(candidates[e], g, rules_.starts_fitted));
  });
  for (Trial& trial : trials) {
    if (!trial.fit) continue;
    trial.gain =
        from->penalised - trial.fit->penalised - kInstantCost * (instants_in_use(*trial.fit) - instants_in_use(*from));
    trial.evidence = base - trial.fit->penalised - cost_of(trial.set, *trial.fit);
    Known& slot = known_[key_of(trial.set)];
    if (!slot.fit || trial.evidence > slot.evidence) slot = {trial.set, trial.fit, trial.evidence};
  }
  std::stable_sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) {
    if (!a.fit || !b.fit) return a.fit && !b.fit;
    return a.evidence > b.evidence;
  });
  if (!trials.empty() && trials.front().fit)
    say("tried every effect beside " + describe(to) + ": best " +
        std::string(trials.front().set.back().effect->name()) + ", chi2 falls by " +
        std::to_string(static_cast<int>(trials.front().gain)));
  return additions_[key] = std::move(trials);
}

const Trial& Selection::best_correction(const EffectSet& beside) {
  const std::string key = key_of(beside);
  if (const auto at = best_corrections_.find(key); at != best_corrections_.end()) return at->second;
  const std::shared_ptr<const Fit> from = known(beside).fit;
  const Ground ground = make_ground(evidence_, *from);
  std::vector<Member> members = corrections_.members();
  std::erase_if(members, [&](const Member& m) { return std::find(beside.begin(), beside.end(), m) != beside.end(); });
  const auto dictionary = make_dictionary(evidence_, *from, ground, members, rules_.threads);
  const NullGains chance = bootstrap_null(dictionary, ground, rules_.bootstrap_draws, rules_.seed, rules_.threads);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t e = 0; e < dictionary.size(); ++e)
    for (const auto& promise : best_promises(dictionary[e], ground, 1)) order.emplace_back(-promise.gain, e);
  std::sort(order.begin(), order.end());
  if (order.size() > kCorrectionsFitted) order.resize(kCorrectionsFitted);
  std::vector<Trial> trials(order.size());
  parallel_for(order.size(), rules_.threads, [&](std::size_t i) {
    const std::size_t e = order[i].second;
    trials[i].set = beside;
    trials[i].set.push_back(dictionary[e].member);
    trials[i].chance = chance.mean[e];
    trials[i].threshold = chance.threshold[e];
    trials[i].fit = fit_addition(evidence_, *from, dictionary[e], best_promises(dictionary[e], ground, 1));
  });
  Trial best;
  const double base = known_.at(key_of({})).fit->penalised;
  for (Trial& trial : trials) {
    if (!trial.fit) continue;
    trial.gain = from->penalised - trial.fit->penalised;
    trial.evidence = base - trial.fit->penalised - cost_of(trial.set, *trial.fit);
    known_[key_of(trial.set)] = {trial.set, trial.fit, trial.evidence};
    if (!best.fit || trial.evidence > best.evidence) best = trial;
  }
  say("looked for what no effect explains beside " + describe(beside));
  return best_corrections_[key] = std::move(best);
}

Correction Selection::describe_correction(const EffectSet& set, std::size_t member) {
  const std::shared_ptr<const Fit> fit = fit_of(set);
  const auto& members = fit->hypothesis.set();
  const auto at = std::find(members.begin(), members.end(), set[member]);
  Correction out = corrections_.describe(*fit, static_cast<std::size_t>(at - members.begin()));
  const EffectSet rest = without_member(set, member);
  out.gain = fit_of(rest)->penalised - fit->penalised;
  const Trial& best = best_correction(rest);
  out.threshold = std::max(best.threshold, best.chance + kVisibleSigmas * kVisibleSigmas);
  return out;
}

// Forward: the best effect that passes.
bool Selection::grow(EffectSet& set) {
  if (static_cast<int>(set.size()) >= rules_.largest_set) return false;
  for (const Trial& trial : additions(set))
    if (trial.fit && trial.passes()) {
      set = trial.set;
      return true;
    }
  return false;
}

// A member for the best other one beside the rest.
bool Selection::swap(EffectSet& set) {
  for (std::size_t m = 0; m < set.size() && set.size() > 1; ++m) {
    if (is_correction(set[m])) continue;
    const auto& others = additions(without_member(set, m));
    if (others.empty() || !others.front().fit || key_of(others.front().set) == key_of(set)) continue;
    if (others.front().evidence <= evidence_of(set) + 1e-6) continue;
    set = others.front().set;
    return true;
  }
  return false;
}

// Backward: a member that the others have made superfluous goes.
bool Selection::shrink(EffectSet& set) {
  for (std::size_t m = 0; m < set.size() && set.size() > 1; ++m) {
    const EffectSet rest = without_member(set, m);
    if (is_correction(set[m])) continue;
    const auto& trials = additions(rest);
    const auto same =
        std::find_if(trials.begin(), trials.end(), [&](const Trial& t) { return key_of(t.set) == key_of(set); });
    if (same == trials.end() || same->passes()) continue;
    set = rest;
    return true;
  }
  return false;
}

// A name has to fit better than a nameless curve in its place: an effect that is on no list often looks somewhat like
// one that is, or like several together.
bool Selection::give_up_names(EffectSet& set) {
  const auto corrections = std::count_if(set.begin(), set.end(), is_correction);
  if (corrections >= kLargestCorrections) return false;
  const auto beats = [&](const Trial& nameless) {
    return nameless.fit && nameless.evidence > evidence_of(set) + kNamelessMargin;
  };
  if (const Trial& alone = best_correction({}); set.size() > 1 && corrections == 0 && beats(alone)) {
    set = alone.set;
    return true;
  }
  for (std::size_t m = 0; m < set.size(); ++m) {
    if (is_correction(set[m])) continue;
    const Trial& nameless = best_correction(without_member(set, m));
    if (!beats(nameless)) continue;
    set = nameless.set;
    return true;
  }
  // Nothing of the library passes any more: is what remains noise?
  const Trial& rest = best_correction(set);
  if (!rest.fit || !rest.passes()) return false;
  if (!set.empty() && examine_remains(evidence_, *fit_of(set)).structure_sigmas < kStructureSigmas) return false;
  set = rest.set;
  return true;
}

// One curve better than two names together: looking for a third is idle. (Better than one name it may be because of a
// second effect that is still to be found.)
bool Selection::far_from_any_name(const EffectSet& set) {
  if (set.size() < 2 || std::any_of(set.begin(), set.end(), is_correction)) return false;
  const Trial& nameless = best_correction({});
  return nameless.fit && nameless.evidence > evidence_of(set) + kNamelessMargin;
}

EffectSet Selection::select() {
  EffectSet now;
  for (int round = 0; round < 12; ++round) {
    // While even nameless curves leave structure, a name beside them would be a guess.
    const bool nameless = std::any_of(now.begin(), now.end(), is_correction);
    if (nameless && examine_remains(evidence_, *fit_of(now)).structure_sigmas > kStructureSigmas) {
      std::erase_if(now, [](const Member& member) { return !is_correction(member); });
      if (!give_up_names(now)) break;
      continue;
    }
    const bool grown = grow(now);
    if (grown && far_from_any_name(now)) {
      now = best_correction({}).set;
      continue;
    }
    const bool exchanged = swap(now) || shrink(now);
    if (!grown && !exchanged && !give_up_names(now)) break;
  }
  return now;
}

std::vector<std::pair<EffectSet, double>> Selection::visited() const {
  std::vector<std::pair<EffectSet, double>> all;
  for (const auto& [key, known] : known_) all.emplace_back(known.set, known.evidence);
  return all;
}

}  // namespace bevel::diagnosis
