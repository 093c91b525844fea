#pragma once
// Which effects are missing: full nonlinear fits of sets of effects, grown, shrunk and swapped until none is better.
//
// An effect enters when the fall of chi2 that it brings exceeds what the maximum over the whole library brings by
// chance in 1 of 100 bootstrap draws, when it is visible (kVisibleSigmas standard deviations above the mean of chance),
// and when it is worth its freedom. Sets are compared by preference: the fall of chi2 less what their freedom is worth
// (freedom.hpp) and their prior odds.
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "diagnosis/mismatch/corrections.hpp"
#include "diagnosis/mismatch/dictionary.hpp"

namespace bevel::diagnosis {

inline constexpr double kVisibleSigmas = 5.0;
// Prior odds against each member of a set, in chi2 (2 ln): a name is one of some twenty. Of nameless curves there are
// three times as many, and what is missing is three times likelier to be on the list than not: one in 150.
inline constexpr double kNamePrice = 6.0;
inline constexpr double kCurvePrice = 10.0;

struct SelectionRules {
  int bootstrap_draws = 400;
  std::uint64_t seed = 1;
  int threads = 2;
  int largest_set = 4;
  std::size_t starts_fitted = 3;  // the most promising of a candidate's starts
};

// One set that was fitted, as an addition to a smaller one.
struct Trial {
  EffectSet set;
  std::shared_ptr<const Fit> fit;
  double gain = 0;        // fall of chi2 (belief included) against the set without the last member
  double chance = 0;      // mean of what noise brings
  double threshold = 0;   // exceeded by chance, over the library, in 1 of 100
  double evidence = 0;    // fall of chi2 against no effect at all
  double preference = 0;  // evidence, less what the set's freedom is worth and its prior odds
  double worth = 0;       // preference, less that of the set without the last member
  double limit() const { return std::max(threshold, chance + kVisibleSigmas * kVisibleSigmas); }
  bool passes() const { return gain > limit() && worth > 0; }
};

class Selection {
 public:
  using Progress = std::function<void(const std::string&)>;
  Selection(const Evidence& evidence, const Fit& base, const SelectionRules& rules, Progress progress = {});

  // Effects added to a set, as many as are worth fitting, the best first. Fitted once, then remembered.
  const std::vector<Trial>& additions(const EffectSet& to);
  // The best set found. A correction among its members says that something is missing that no effect of the library
  // explains: it fits better than the best effect did, or something remains beside the effects.
  EffectSet select();
  // The best nameless correction beside a set; its fit is null if there is none.
  const Trial& best_correction(const EffectSet& beside);

  // A correction of a set, as data, with its gain over the set without it.
  Correction describe_correction(const EffectSet& set, std::size_t member);

  std::shared_ptr<const Fit> fit_of(const EffectSet& set);
  double preference_of(const EffectSet& set);
  // All sets fitted so far, with their preference.
  std::vector<std::pair<EffectSet, double>> visited() const;
  const Evidence& evidence() const { return evidence_; }
  const SelectionRules& rules() const { return rules_; }
  // Signatures of the library beside no effect, and what they are relative to.
  const std::vector<Candidate>& dictionary() const { return library_.candidates; }
  const Ground& ground() const { return library_.ground; }

 private:
  struct Known {
    EffectSet set;
    std::shared_ptr<const Fit> fit;
    double evidence = 0;
    double preference = 0;
  };
  // Candidates beside a fit, as far as they have room, and what chance brings to each.
  struct Library {
    Ground ground;
    std::vector<Candidate> candidates;
    NullGains chance;
  };
  Library make_library(const Fit& from, std::vector<Member> members) const;
  static std::vector<std::size_t> most_promising(const Library& library, std::size_t count);
  std::vector<std::size_t> worth_fitting(const EffectSet& beside, const Library& library) const;
  std::vector<Trial> try_beside(const EffectSet& set, const Library& library, const std::vector<std::size_t>& which,
                                std::size_t starts);
  bool improve(const EffectSet& set, const Fit& larger);
  Known& known(const EffectSet& set);
  double evidence_of(const EffectSet& set);
  Known judged(const EffectSet& set, std::shared_ptr<const Fit> fit) const;
  void say(const std::string& text) const;
  double least_gain_beside(const EffectSet& set);
  bool enough_beside(const EffectSet& set, const Trial& trial);
  bool grow(EffectSet& set);
  bool complete(EffectSet& set);
  bool swap(EffectSet& set);
  bool shrink(EffectSet& set);
  bool find_pair(EffectSet& set);
  bool give_up_names(EffectSet& set);
  bool far_from_any_name(const EffectSet& set);
  void doubt_instants(EffectSet& set);

  const Evidence& evidence_;
  SelectionRules rules_;
  Progress progress_;
  std::map<std::string, Known> known_;  // by sorted names
  std::map<std::string, std::vector<Trial>> additions_;
  Library library_;  // beside no effect
  bool pairs_tried_ = false;
  CorrectionLibrary corrections_;
  std::map<std::string, Trial> best_corrections_;
};

EffectSet without_member(const EffectSet& set, std::size_t index);
std::string key_of(const EffectSet& set);

}  // namespace bevel::diagnosis
