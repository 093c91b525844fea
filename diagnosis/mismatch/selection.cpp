#include "diagnosis/mismatch/selection.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/mismatch/addition.hpp"
#include "diagnosis/mismatch/freedom.hpp"
#include "diagnosis/mismatch/gates.hpp"
#include "diagnosis/mismatch/local_unknowns.hpp"
#include "diagnosis/mismatch/pairs.hpp"
#include "diagnosis/mismatch/parallel.hpp"

namespace bevel::diagnosis {
namespace {
constexpr int kImprovements = 2;
constexpr double kNoticeable = 0.5;  // chi2
constexpr std::size_t kCorrectionsFitted = 3;
constexpr std::size_t kShortlist = 12;  // effects fitted beside others
constexpr int kLargestCorrections = 2;
constexpr std::size_t kPairs = 8;  // of effects, fitted before names are given up
constexpr double kAtBound = 1.03;
constexpr double kIncidental = 0.2;  // of what the curves beside it explain
constexpr double kStandsOut = 9.2;   // odds of 100 to 1

bool has_correction(const EffectSet& set) { return std::any_of(set.begin(), set.end(), is_correction); }

std::string member_key(const Member& member) {
  return std::string(member.effect->name()) + "/" + std::to_string(member.variant);
}

// A swing whose best frequency is the lowest or highest there is has not been seen to swing.
bool has_no_period(const Fit& fit) {
  const auto& unknowns = fit.hypothesis.unknowns();
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const Unknown& u = unknowns[i];
    if (u.member < 0) continue;
    const auto& effect = *fit.hypothesis.set()[static_cast<std::size_t>(u.member)].effect;
    if (!effect.parameters()[static_cast<std::size_t>(u.parameter)].frequency) continue;
    const double value = fit.values[static_cast<Eigen::Index>(i)];
    if (value < kAtBound * u.lower || value * kAtBound > u.upper) return true;
  }
  return false;
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

Selection::Selection(const Evidence& evidence, const Fit& base, const SelectionRules& rules, Progress progress)
    : evidence_(evidence), rules_(rules), progress_(std::move(progress)), corrections_(*evidence.recorded) {
  known_[key_of({})] = {{}, std::make_shared<Fit>(base), 0, 0};
  library_ = make_library(base, members_of_library({}));
}

void Selection::say(const std::string& text) const {
  if (progress_) progress_(text);
}

Selection::Library Selection::make_library(const Fit& from, std::vector<Member> members) const {
  EffectSet set = from.hypothesis.set();
  set.emplace_back();
  std::erase_if(members, [&set](const Member& member) {
    set.back() = member;
    return !can_be_fitted(set);
  });
  Library library;
  library.ground = make_ground(evidence_, from);
  library.candidates = make_dictionary(evidence_, from, library.ground, members, rules_.threads);
  library.chance =
      bootstrap_null(library.candidates, library.ground, rules_.bootstrap_draws, rules_.seed, rules_.threads);
  return library;
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
  return known_[key] = fit ? judged(set, fit) : part;
}

std::shared_ptr<const Fit> Selection::fit_of(const EffectSet& set) { return known(set).fit; }
double Selection::evidence_of(const EffectSet& set) { return known(set).evidence; }
double Selection::preference_of(const EffectSet& set) { return known(set).preference; }

Selection::Known Selection::judged(const EffectSet& set, std::shared_ptr<const Fit> fit) const {
  Known out{.set = set, .fit = std::move(fit)};
  out.evidence = known_.at(key_of({})).fit->penalised - cost_of(*out.fit);
  out.preference = out.evidence - price_of_freedom(*out.fit);
  for (const Member& member : set) out.preference -= is_correction(member) ? kCurvePrice : kNamePrice;
  return out;
}

// By what the linear model promises beyond chance.
std::vector<std::size_t> Selection::most_promising(const Library& library, std::size_t count) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t e = 0; e < library.candidates.size(); ++e)
    for (const auto& promise : best_promises(library.candidates[e], library.ground, 1))
      order.emplace_back(library.chance.mean[e] - promise.gain, e);
  std::sort(order.begin(), order.end());
  if (order.size() > count) order.resize(count);
  std::vector<std::size_t> out;
  for (const auto& [gain, e] : order) out.push_back(e);
  return out;
}

// All effects beside nothing; beside others the most promising, and those that the set was fitted with already, by
// another way: how they stand beside it is asked too.
std::vector<std::size_t> Selection::worth_fitting(const EffectSet& beside, const Library& library) const {
  std::vector<std::size_t> all(library.candidates.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  if (beside.empty()) return all;
  std::vector<std::size_t> out = most_promising(library, kShortlist);
  EffectSet larger = beside;
  larger.emplace_back();
  for (const std::size_t e : all) {
    larger.back() = library.candidates[e].member;
    if (known_.contains(key_of(larger)) && std::find(out.begin(), out.end(), e) == out.end()) out.push_back(e);
  }
  return out;
}

// Some candidates of a library, each added to the set and fitted; what cannot be fitted is left out.
std::vector<Trial> Selection::try_beside(const EffectSet& set, const Library& library,
                                         const std::vector<std::size_t>& which, std::size_t starts) {
  const std::shared_ptr<const Fit> from = known(set).fit;
  std::vector<Trial> trials(which.size());
  parallel_for(which.size(), rules_.threads, [&](std::size_t i) {
    const Candidate& candidate = library.candidates[which[i]];
    Trial& trial = trials[i];
    trial.set = set;
    trial.set.push_back(candidate.member);
    trial.chance = library.chance.mean[which[i]];
    trial.threshold = library.chance.threshold[which[i]];
    trial.fit = fit_addition(evidence_, *from, candidate, best_promises(candidate, library.ground, starts));
  });
  std::erase_if(trials, [](const Trial& trial) { return !trial.fit || has_no_period(*trial.fit); });
  for (Trial& trial : trials) {
    trial.gain = cost_of(*from) - cost_of(*trial.fit);
    const Known now = judged(trial.set, trial.fit);
    trial.evidence = now.evidence;
    trial.preference = now.preference;
    trial.worth = now.preference - preference_of(set);
    Known& slot = known_[key_of(trial.set)];
    if (!slot.fit || now.evidence > slot.evidence) slot = now;
  }
  std::stable_sort(trials.begin(), trials.end(),
                   [](const Trial& a, const Trial& b) { return a.preference > b.preference; });
  return trials;
}

// The fit of more may have come upon a better valley for the unknowns that both have: what the set gains there is not
// the addition's.
bool Selection::improve(const EffectSet& set, const Fit& larger) {
  Known& now = known(set);
  const Hypothesis& hypothesis = now.fit->hypothesis;
  const auto moved = std::make_shared<Fit>(
      fit_beside_instants(evidence_, hypothesis, hypothesis.start_from(larger.hypothesis, larger.values)));
  if (!moved->valid || cost_of(*moved) > cost_of(*now.fit) - kNoticeable) return false;
  now = judged(set, from_other_sizes(evidence_, moved));
  best_corrections_.erase(key_of(set));
  return true;
}

const std::vector<Trial>& Selection::additions(const EffectSet& to) {
  const std::string key = key_of(to);
  if (const auto at = additions_.find(key); at != additions_.end()) return at->second;
  std::vector<Trial> trials;
  for (int turn = 0; turn <= kImprovements; ++turn) {
    Library beside;
    if (!to.empty()) beside = make_library(*known(to).fit, members_of_library(to));
    const Library& library = to.empty() ? library_ : beside;
    trials = try_beside(to, library, worth_fitting(to, library), rules_.starts_fitted);
    if (to.empty() || trials.empty() || !improve(to, *trials.front().fit)) break;
  }
  if (!trials.empty())
    say("tried every effect beside " + describe(to) + ": best " +
        std::string(trials.front().set.back().effect->name()) + ", chi2 falls by " +
        std::to_string(static_cast<int>(trials.front().gain)));
  return additions_[key] = std::move(trials);
}

const Trial& Selection::best_correction(const EffectSet& beside) {
  const std::string key = key_of(beside);
  if (const auto at = best_corrections_.find(key); at != best_corrections_.end()) return at->second;
  std::vector<Member> members = corrections_.members();
  std::erase_if(members, [&](const Member& m) { return std::find(beside.begin(), beside.end(), m) != beside.end(); });
  const Library library = make_library(*known(beside).fit, members);
  const auto trials = try_beside(beside, library, most_promising(library, kCorrectionsFitted), 1);
  say("looked for what no effect explains beside " + describe(beside));
  return best_corrections_[key] = trials.empty() ? Trial{} : trials.front();
}

Correction Selection::describe_correction(const EffectSet& set, std::size_t member) {
  const std::shared_ptr<const Fit> fit = fit_of(set);
  const auto& members = fit->hypothesis.set();
  const auto at = std::find(members.begin(), members.end(), set[member]);
  Correction out = corrections_.describe(*fit, static_cast<std::size_t>(at - members.begin()));
  const EffectSet rest = without_member(set, member);
  out.gain = fit_of(rest)->penalised - fit->penalised;
  out.threshold = best_correction(rest).limit();
  return out;
}

// What a name has to bring beside a set. Beside a curve, which is only roughly what it stands for, it has to be more
// than a detail of that: a share of what the set's curves explain.
double Selection::least_gain_beside(const EffectSet& set) {
  if (!has_correction(set)) return 0;
  EffectSet names = set;
  std::erase_if(names, is_correction);
  return kIncidental * std::max(0.0, evidence_of(set) - evidence_of(names));
}

// Or it stands out: with it only noise is left (of less than was measured without it, perhaps), and no other name nor a
// further curve comes near.
bool Selection::enough_beside(const EffectSet& set, const Trial& trial) {
  if (!trial.passes()) return false;
  if (trial.gain > least_gain_beside(set)) return true;
  const Remains remains = examine_remains(evidence_, *trial.fit);
  if (remains.has_structure() || remains.chi2_per_dof > remains.band[1]) return false;
  double next = best_correction(set).fit ? best_correction(set).preference : preference_of(set);
  for (const Trial& other : additions(set))
    if (key_of(other.set) != key_of(trial.set)) next = std::max(next, other.preference);
  return trial.preference > next + kStandsOut;
}

// Forward: the best effect that passes.
bool Selection::grow(EffectSet& set) {
  if (static_cast<int>(set.size()) >= rules_.largest_set) return false;
  for (const Trial& trial : additions(set))
    if (enough_beside(set, trial)) {
      set = trial.set;
      return true;
    }
  return false;
}

// One name beside nameless curves that leaves nothing over, and is better than a further curve.
bool Selection::complete(EffectSet& set) {
  for (const Trial& trial : additions(set)) {
    if (!enough_beside(set, trial)) continue;
    if (examine_remains(evidence_, *trial.fit).has_structure()) continue;
    const Trial& nameless = best_correction(set);
    if (nameless.fit && nameless.preference > trial.preference) return false;
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
    if (others.empty() || key_of(others.front().set) == key_of(set)) continue;
    if (others.front().preference <= preference_of(set) + 1e-6) continue;
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
    if (improve(rest, *fit_of(set))) additions_.erase(key_of(rest));
    const auto& trials = additions(rest);
    const auto same =
        std::find_if(trials.begin(), trials.end(), [&](const Trial& t) { return key_of(t.set) == key_of(set); });
    if (same == trials.end() || enough_beside(rest, *same)) continue;
    set = rest;
    return true;
  }
  return false;
}

// Before names are given up: a pair of which neither is the best alone, once.
bool Selection::find_pair(EffectSet& set) {
  if (pairs_tried_) return false;
  pairs_tried_ = true;
  EffectSet best = set;
  for (const auto& [one, other] : best_pairs(library_.candidates, library_.ground, kPairs)) {
    const EffectSet pair = {library_.candidates[one].member, library_.candidates[other].member};
    const bool fitted = fit_of(pair)->hypothesis.set().size() == pair.size();
    if (fitted && preference_of(pair) > preference_of(best)) best = pair;
  }
  say("tried pairs: best " + describe(best) + ", worth " + std::to_string(std::lround(preference_of(best))));
  if (key_of(best) == key_of(set)) return false;
  set = best;
  return true;
}

// A name has to fit better than a nameless curve in its place: an effect that is on no list often looks somewhat like
// one that is, or like several together.
bool Selection::give_up_names(EffectSet& set) {
  const auto corrections = std::count_if(set.begin(), set.end(), is_correction);
  if (corrections >= kLargestCorrections) return false;
  const auto give_way = [&](const Trial& nameless) {
    if (corrections > 0 || !find_pair(set)) set = nameless.set;
    return true;
  };
  const auto beats = [&](const Trial& nameless) {
    if (nameless.fit)
      say(describe(nameless.set) + " instead: worth " + std::to_string(std::lround(nameless.preference)) +
          ", the names " + std::to_string(std::lround(preference_of(set))));
    return nameless.fit && nameless.preference > preference_of(set);
  };
  if (const Trial& alone = best_correction({}); set.size() > 1 && corrections == 0 && beats(alone))
    return give_way(alone);
  for (std::size_t m = 0; m < set.size(); ++m) {
    if (is_correction(set[m])) continue;
    const Trial& nameless = best_correction(without_member(set, m));
    if (beats(nameless)) return give_way(nameless);
  }
  // Nothing of the library passes any more: is what remains noise?
  const Trial& rest = best_correction(set);
  if (!rest.fit || !rest.passes()) return false;
  if (!set.empty() && examine_remains(evidence_, *fit_of(set)).structure_sigmas < kStructureSigmas) return false;
  // That something is missing is settled by this curve. A name that explains nearly as much is the better guess at
  // what, even where it would not have been enough by itself.
  if (static_cast<int>(set.size()) < rules_.largest_set && corrections == 0)
    for (const Trial& named : additions(set))
      if (named.gain > kVisibleSigmas * kVisibleSigmas && named.preference > rest.preference) {
        set = named.set;
        return true;
      }
  set = rest.set;
  return true;
}

// One curve better than two names together: looking for a third is idle. (Better than one name it may be because of a
// second effect that is still to be found.)
bool Selection::far_from_any_name(const EffectSet& set) {
  if (set.size() < 2 || has_correction(set)) return false;
  const Trial& nameless = best_correction({});
  return nameless.fit && nameless.preference > preference_of(set);
}

// What may happen at any instant, or not at all, explains a part of anything: where what is left is no noise it is a
// detail of something else, and a nameless curve describes that better if one does.
void Selection::doubt_instants(EffectSet& set) {
  if (std::none_of(set.begin(), set.end(), has_instants)) return;
  if (!examine_remains(evidence_, *fit_of(set)).has_structure()) return;
  std::erase_if(set, has_instants);
  say("what may happen at any instant is no finding while structure is left: it goes");
  if (has_correction(set)) return;
  if (const Trial& nameless = best_correction(set); nameless.fit && nameless.passes()) set = nameless.set;
}

EffectSet Selection::select() {
  EffectSet now;
  for (int round = 0; round < 12; ++round) {
    // While even nameless curves leave structure, a name beside them would be a guess; but not one that explains most.
    if (has_correction(now) && examine_remains(evidence_, *fit_of(now)).has_structure()) {
      EffectSet nameless = now;
      std::erase_if(nameless, [](const Member& member) { return !is_correction(member); });
      if (evidence_of(nameless) > 0.5 * evidence_of(now)) {
        now = nameless;
        if (!complete(now) && !give_up_names(now)) break;
        continue;
      }
    }
    const bool grown = grow(now);
    if (grown && far_from_any_name(now)) {
      if (!find_pair(now)) now = best_correction({}).set;
      continue;
    }
    const bool exchanged = swap(now) || shrink(now);
    if (!grown && !exchanged && !give_up_names(now)) break;
  }
  doubt_instants(now);
  return now;
}

std::vector<std::pair<EffectSet, double>> Selection::visited() const {
  std::vector<std::pair<EffectSet, double>> all;
  for (const auto& [key, known] : known_) all.emplace_back(known.set, known.preference);
  return all;
}

}  // namespace bevel::diagnosis
