// SPDX-License-Identifier: MIT
#pragma once
// verdict.json of the tool under test, as far as it is scored. Nothing here trusts it.
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bevel::proof {

struct Estimate {
  double value = 0;
  std::optional<double> std_error;
  std::optional<double> low95, high95;
};

struct NamedEffect {
  std::string name;
  double probability = 1.0;  // where the verdict gives none
  std::vector<std::string> ambiguous_with;
  std::map<std::string, Estimate> parameters;
  std::map<std::string, double> at_s;  // log file -> instant, of effects that have one per recording
};

struct Location {
  std::string log;  // file name; "" all
  std::optional<double> from_s, to_s;
  std::string covariate;
  std::optional<double> range_low, range_high;
};

// One set of the tool's posterior.
struct Explanation {
  std::vector<std::string> effects;  // names, sorted
  double probability = 0;
  double with_discrepancy = 0;  // of it, beside something that has no name, of any size
};
struct PosteriorGiven {
  double nothing_missing = 0;
  double discrepancy = 0;  // of a size that counts
  std::vector<Explanation> explanations;
};

struct Verdict {
  std::string kind;  // nothing-missing, effects-found, unknown-effect
  std::vector<NamedEffect> effects;
  std::vector<Location> where;
  std::map<std::string, Estimate> needle;  // its parameters with what was found
  std::optional<PosteriorGiven> posterior;
  std::optional<double> chi2_before, chi2_after;  // held-out, per degree of freedom
  std::optional<double> rmse_before_mm, rmse_after_mm;
  std::optional<double> log_density_before, log_density_after;  // predictive, held-out, natural, per reading

  // Sorted, without repeats: the effects named, and "unknown" for unknown-effect.
  std::vector<std::string> named() const;
};

// Throws ParseError saying what is wrong: no JSON, an unknown verdict, an effect without a name, a verdict that
// contradicts itself (nothing missing, yet effects; effects found, yet none), a number that is none.
Verdict parse_verdict(std::string_view text);

}  // namespace bevel::proof
