// SPDX-License-Identifier: MIT
#pragma once
// One verdict against its truth.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proof/verdict.hpp"

namespace bevel::proof {

// The truth as it was sealed, read back.
struct OpenedEffect {
  std::string name;  // "unknown" for what is on no list
  std::string kind;
  double visible_sigmas = 0;
  std::map<std::string, double> parameters;
  std::vector<double> at_s;                    // a recording each, 0: not there
  std::map<std::string, double> nearest = {};  // parameters by which the plain form comes closest to the plant
};
struct OpenedTruth {
  int trial = 0;
  std::string trial_class;
  std::string plant;
  bool rich_scripts = true;
  double visible_sigmas = 0;
  std::vector<std::string> expected;
  std::vector<OpenedEffect> effects;
  std::map<std::string, double> needle = {};  // its parameters
  std::vector<std::string> rivals;            // listed effects that these recordings cannot tell from the unlisted one
};
OpenedTruth parse_truth(std::string_view text);  // throws ParseError

enum class Visibility {
  null,       // nothing concealed
  invisible,  // concealed, and nothing of it visible: "nothing missing" is right
  partly,     // of two, one is visible
  visible     // all of it
};
const char* name_of(Visibility visibility);

struct ParameterScore {
  std::string effect;
  std::string parameter;
  double truth = 0;
  double value = 0;
  std::optional<double> z;      // (value - truth) / std_error
  std::optional<bool> covered;  // by ci95
  // The same against what the plain form comes to on this plant without noise.
  std::optional<double> z_nearest = {};
  std::optional<bool> covers_nearest = {};
};

struct LocationScore {
  std::string effect;
  double error = 0;
  bool in_seconds = false;  // else mm
};

struct FoundEffect {  // per concealed effect
  std::string name;
  double visible_sigmas = 0;
  bool named = false;
};

struct TrialScore {
  int trial = 0;
  std::string trial_class;
  std::string plant;
  Visibility visibility = Visibility::null;
  double visible_sigmas = 0;
  std::vector<std::string> expected;
  std::vector<std::string> concealed;  // kinds of unknown ones in place of "unknown"
  std::vector<std::string> named;
  std::vector<std::string> rivals;
  bool abstained = false;
  std::string abstention;  // why there is no verdict; "inconclusive": the verdict decides nothing
  bool strict = false;   // named is what was expected, and beside it nothing but what is concealed too faintly for that
  bool lenient = false;  // so it is, with names out of ambiguous_with, or of a rival
  double probability_of_truth = 0;  // of all that is right to say
  double probability_of_said = 0;
  std::vector<FoundEffect> found;
  std::vector<ParameterScore> parameters;
  // k, lambda1 and lambda2 where everything that was concealed is named rightly, or nothing was: what nobody sees of it
  // is in these. Of the beam they have no truth.
  std::vector<ParameterScore> needle;
  std::vector<LocationScore> locations;
  std::optional<double> chi2_before, chi2_after, rmse_before_mm, rmse_after_mm;
  std::optional<double> log_density_before, log_density_after;
  double seconds = 0;
};

TrialScore score_verdict(const OpenedTruth& truth, const Verdict& verdict);
TrialScore score_abstention(const OpenedTruth& truth, const std::string& why);

}  // namespace bevel::proof
