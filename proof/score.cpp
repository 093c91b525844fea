// SPDX-License-Identifier: MIT
#include "proof/score.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include <bevel/error.hpp>

namespace bevel::proof {

using nlohmann::json;

namespace {

using Names = std::vector<std::string>;

bool holds(const Names& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }

// Every expected id has a named effect of its own, by name or by ambiguous_with, and no named effect is left over.
bool matches_leniently(const Names& expected, const Verdict& verdict) {
  Names wanted = expected;
  if (holds(wanted, "unknown") != (verdict.kind == "unknown-effect")) return false;
  std::erase(wanted, "unknown");
  if (wanted.size() != verdict.effects.size()) return false;
  std::ranges::sort(wanted);
  do {
    bool all = true;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const NamedEffect& effect = verdict.effects[i];
      all = all && (effect.name == wanted[i] || holds(effect.ambiguous_with, wanted[i]));
    }
    if (all) return true;
  } while (std::ranges::next_permutation(wanted).found);
  return false;
}

// Of a set, "unknown" in it or not, by the sets that the tool lists. A discrepancy too small to count is said in none
// of the verdicts: of what lies beside one, the share that counts is that over all sets.
double probability_by(const PosteriorGiven& posterior, Names expected) {
  if (expected.empty()) return posterior.nothing_missing;
  const bool unknown = std::erase(expected, "unknown") > 0;
  std::ranges::sort(expected);
  double beside = 0;
  for (const Explanation& one : posterior.explanations) beside += one.with_discrepancy;
  const double counts = beside > 0 ? std::min(1.0, posterior.discrepancy / beside) : 0;
  double p = 0;
  for (const Explanation& one : posterior.explanations)
    if (one.effects == expected)
      p += unknown ? counts * one.with_discrepancy : one.probability - counts * one.with_discrepancy;
  return std::clamp(p, 0.0, 1.0);
}

// What is right to say: all that is visible, and of what is concealed below that, any of it or nothing.
std::vector<Names> right_answers(const OpenedTruth& truth) {
  std::vector<Names> out{truth.expected};
  std::ranges::sort(out.front());
  std::set<std::string> faint;
  for (const OpenedEffect& effect : truth.effects)
    if (!holds(truth.expected, effect.name)) faint.insert(effect.name);
  for (const std::string& name : faint)
    for (std::size_t i = 0, known = out.size(); i < known; ++i) {
      Names more = out[i];
      more.insert(std::ranges::upper_bound(more, name), name);
      out.push_back(std::move(more));
    }
  return out;
}

double probability_of(const Names& expected, const Verdict& verdict) {
  if (verdict.posterior) return probability_by(*verdict.posterior, expected);
  if (holds(expected, "unknown") != (verdict.kind == "unknown-effect")) return 0.0;
  double p = 1.0;
  for (const std::string& name : expected)
    if (name != "unknown" && std::ranges::none_of(verdict.effects, [&](const auto& e) { return e.name == name; }))
      return 0.0;
  for (const NamedEffect& effect : verdict.effects)
    p *= holds(expected, effect.name) ? effect.probability : 1.0 - effect.probability;
  return p;
}

// A direction of motion is a line, not an arrow.
double difference(const std::string& parameter, double value, double truth) {
  double d = value - truth;
  if (parameter == "direction_rad") d = std::remainder(d, std::numbers::pi);
  return d;
}

void score_parameters(const OpenedEffect& truth, const NamedEffect& named, TrialScore& score) {
  for (const auto& parameter : truth.parameters) {
    const auto& [name, true_value] = parameter;
    const auto found = named.parameters.find(name);
    if (found == named.parameters.end()) continue;
    const Estimate& estimate = found->second;
    ParameterScore p{truth.name, name, true_value, estimate.value, {}, {}};
    const auto compare = [&](double with, std::optional<double>& z, std::optional<bool>& covered) {
      const double d = difference(parameter.first, estimate.value, with);
      if (estimate.std_error && *estimate.std_error > 0.0) z = d / *estimate.std_error;
      // The interval moves with the estimate where a direction is turned to the truth's side.
      const double shift = with + d - estimate.value;
      if (estimate.low95 && estimate.high95)
        covered = *estimate.low95 + shift <= with && with <= *estimate.high95 + shift;
    };
    compare(true_value, p.z, p.covered);
    if (const auto nearest = truth.nearest.find(name); nearest != truth.nearest.end())
      compare(nearest->second, p.z_nearest, p.covers_nearest);
    score.parameters.push_back(p);
  }
}

std::optional<double> nearest_instant(const Verdict& verdict, const NamedEffect& named, const std::string& log,
                                      double at_s) {
  if (const auto own = named.at_s.find(log); own != named.at_s.end() && own->second > 0)
    return std::abs(own->second - at_s);
  std::optional<double> best;
  for (const Location& location : verdict.where)
    if (location.log == log && location.from_s) {
      const double error = std::abs(*location.from_s - at_s);
      if (!best || error < *best) best = error;
    }
  return best;
}

void score_location(const OpenedEffect& truth, const NamedEffect& named, const Verdict& verdict, TrialScore& score) {
  for (std::size_t i = 0; i < truth.at_s.size(); ++i) {
    if (truth.at_s[i] <= 0.0) continue;
    const std::string log = "rec0" + std::to_string(i + 1) + ".lcm";
    if (const auto error = nearest_instant(verdict, named, log, truth.at_s[i]))
      score.locations.push_back({truth.name, *error, true});
  }
  const auto depth = truth.parameters.find("depth_mm");
  if (depth == truth.parameters.end()) return;
  std::optional<double> error;
  if (const auto own = named.parameters.find("depth_mm"); own != named.parameters.end())
    error = std::abs(own->second.value - depth->second);
  else
    for (const Location& location : verdict.where)
      if (location.covariate == "depth_mm" && location.range_low) {
        const double e = std::abs(*location.range_low - depth->second);
        if (!error || e < *error) error = e;
      }
  if (error) score.locations.push_back({truth.name, *error, false});
}

constexpr const char* kNeedle[] = {"curvature_per_mm", "lambda1_per_rad", "lambda2"};

void score_needle(const OpenedTruth& truth, const Verdict& verdict, TrialScore& score) {
  constexpr double k95 = 1.96;
  std::set<std::string> concealed;
  for (const OpenedEffect& effect : truth.effects) concealed.insert(effect.name);
  const bool all_named = score.named == Names(concealed.begin(), concealed.end());
  if (truth.plant == "beam" || !all_named || concealed.contains("unknown")) return;
  for (const char* name : kNeedle) {
    const auto found = verdict.needle.find(name);
    const auto true_value = truth.needle.find(name);
    if (found == verdict.needle.end() || true_value == truth.needle.end()) continue;
    ParameterScore p{"needle", name, true_value->second, found->second.value, {}, {}};
    if (const auto error = found->second.std_error; error && *error > 0) {
      p.z = (p.value - p.truth) / *error;
      p.covered = std::abs(*p.z) <= k95;
    }
    score.needle.push_back(p);
  }
}

TrialScore begin(const OpenedTruth& truth) {
  TrialScore score;
  score.trial = truth.trial;
  score.trial_class = truth.trial_class;
  score.plant = truth.plant;
  score.visible_sigmas = truth.visible_sigmas;
  score.expected = truth.expected;
  score.rivals = truth.rivals;
  std::set<std::string> concealed;
  for (const OpenedEffect& effect : truth.effects) {
    score.concealed.push_back(effect.kind.empty() ? effect.name : effect.kind);
    concealed.insert(effect.name);
    score.found.push_back({effect.name, effect.visible_sigmas, false});
  }
  score.visibility = truth.effects.empty()                      ? Visibility::null
                     : truth.expected.empty()                   ? Visibility::invisible
                     : truth.expected.size() < concealed.size() ? Visibility::partly
                                                                : Visibility::visible;
  return score;
}

}  // namespace

const char* name_of(Visibility visibility) {
  switch (visibility) {
    case Visibility::null:
      return "null";
    case Visibility::invisible:
      return "invisible";
    case Visibility::partly:
      return "partly";
    case Visibility::visible:
      break;
  }
  return "visible";
}

OpenedTruth parse_truth(std::string_view text) {
  try {
    const json j = json::parse(text);
    OpenedTruth truth;
    truth.trial = j.at("trial");
    truth.trial_class = j.at("class");
    truth.plant = j.at("plant");
    truth.rich_scripts = j.at("rich_scripts");
    truth.visible_sigmas = j.at("visible_sigmas");
    truth.expected = j.at("expected").get<Names>();
    for (const json& e : j.at("effects")) {
      OpenedEffect effect{e.at("name"), e.value("kind", ""), e.at("visible_sigmas"), e.at("parameters"), {}};
      if (e.contains("per_recording") && e.at("per_recording").contains("at_s"))
        effect.at_s = e.at("per_recording").at("at_s").get<std::vector<double>>();
      if (e.contains("nearest")) effect.nearest = e.at("nearest").get<std::map<std::string, double>>();
      truth.effects.push_back(std::move(effect));
    }
    for (const char* name : kNeedle)
      if (j.contains("needle")) truth.needle[name] = j.at("needle").at(name);
    for (const json& rival : j.at("rivals")) truth.rivals.push_back(rival.at("name"));
    return truth;
  } catch (const json::exception& e) {
    throw ParseError(std::string("a truth cannot be read: ") + e.what());
  }
}

TrialScore score_verdict(const OpenedTruth& truth, const Verdict& verdict) {
  if (verdict.kind == "inconclusive") return score_abstention(truth, "inconclusive");
  TrialScore score = begin(truth);
  score.named = verdict.named();
  const bool imitated = score.named.size() == 1 && holds(truth.rivals, score.named[0]);
  score.lenient = imitated;
  for (const Names& right : right_answers(truth)) {
    score.strict = score.strict || score.named == right;
    score.lenient = score.lenient || matches_leniently(right, verdict);
    score.probability_of_truth += probability_of(right, verdict);
  }
  score.lenient = score.lenient || score.strict;
  score.probability_of_said = probability_of(score.named, verdict);
  for (FoundEffect& found : score.found) found.named = holds(score.named, found.name);
  for (const OpenedEffect& effect : truth.effects) {
    if (!holds(truth.expected, effect.name)) continue;
    for (const NamedEffect& named : verdict.effects)
      if (named.name == effect.name) {
        score_parameters(effect, named, score);
        score_location(effect, named, verdict, score);
      }
  }
  score_needle(truth, verdict, score);
  score.chi2_before = verdict.chi2_before;
  score.chi2_after = verdict.chi2_after;
  score.rmse_before_mm = verdict.rmse_before_mm;
  score.rmse_after_mm = verdict.rmse_after_mm;
  score.log_density_before = verdict.log_density_before;
  score.log_density_after = verdict.log_density_after;
  return score;
}

TrialScore score_abstention(const OpenedTruth& truth, const std::string& why) {
  TrialScore score = begin(truth);
  score.abstained = true;
  score.abstention = why;
  return score;
}

}  // namespace bevel::proof
