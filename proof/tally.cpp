// SPDX-License-Identifier: MIT
#include "proof/tally.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace bevel::proof {
namespace {

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

// Each expected id against what was named for it: itself, something else that was not expected, or nothing. What was
// named beyond that stands in a row of its own, since it is no alarm where there was nothing; where nothing was
// expected, in the row of "none". What is concealed too faintly to be expected is no row, named or not.
void confuse(const TrialScore& score, Tally& tally) {
  std::vector<std::string> extra;
  std::vector<std::string> missed;
  const auto concealed = [&](const std::string& name) {
    return std::ranges::any_of(score.found, [&](const FoundEffect& found) { return found.name == name; });
  };
  for (const auto& name : score.named)
    if (!concealed(name)) extra.push_back(name);
  for (const auto& name : score.expected) {
    if (holds(score.named, name))
      ++tally.confusion[name][name];
    else
      missed.push_back(name);
  }
  for (std::size_t i = 0; i < missed.size(); ++i) ++tally.confusion[missed[i]][i < extra.size() ? extra[i] : "none"];
  for (std::size_t i = missed.size(); i < extra.size(); ++i)
    ++tally.confusion[score.expected.empty() ? "none" : kBeyond][extra[i]];
  if (score.expected.empty() && extra.empty()) ++tally.confusion["none"]["none"];
}

void note_sensitivity(const TrialScore& score, Tally& tally) {
  for (SensitivityBin& bin : tally.sensitivity) {
    const auto in_bin = [&](double sigmas) { return bin.low_sigmas <= sigmas && sigmas < bin.high_sigmas; };
    for (const FoundEffect& found : score.found)
      if (in_bin(found.visible_sigmas)) bin.named.add(found.named);
    if (score.visibility != Visibility::null && in_bin(score.visible_sigmas)) bin.alarmed.add(!score.named.empty());
  }
}

void note_shares(const TrialScore& score, Tally& tally) {
  const std::string visibility = name_of(score.visibility);
  tally.strict[visibility].add(score.strict);
  tally.strict["all"].add(score.strict);
  tally.lenient[visibility].add(score.lenient);
  tally.lenient["all"].add(score.lenient);
  const std::string kind = score.plant == "beam" ? "beam" : score.trial_class;
  if (score.visibility == Visibility::visible) tally.strict_by_class[kind].add(score.strict);
  const bool unlisted = holds(score.expected, "unknown");
  if (unlisted) tally.unknown_called_unknown.add(holds(score.named, "unknown"));
  if (unlisted && score.rivals.empty()) tally.unknown_distinct.add(holds(score.named, "unknown"));
  const bool none_unlisted = std::ranges::none_of(score.found, [](const auto& f) { return f.name == "unknown"; });
  if (none_unlisted && !score.abstained) tally.unknown_alarms.add(holds(score.named, "unknown"));
  if (score.visibility == Visibility::null && !score.abstained) tally.false_alarms.add(!score.named.empty());
}

void note_fit(const TrialScore& score, Tally& tally) {
  // Where nothing is said there is no other model; what a refit changes is rounding.
  const bool unlisted = holds(score.expected, "unknown"), said = !score.named.empty();
  if (unlisted && score.log_density_before && score.log_density_after)
    tally.unknown_likelier.add(said && *score.log_density_after > *score.log_density_before);
  if (unlisted && score.rmse_before_mm && score.rmse_after_mm)
    tally.unknown_nearer.add(said && *score.rmse_after_mm < *score.rmse_before_mm);
  if (score.chi2_before) tally.chi2_before.push_back(*score.chi2_before);
  if (!score.chi2_after) return;
  tally.chi2_after.push_back(*score.chi2_after);
  if (score.strict && !holds(score.expected, "unknown"))
    tally.chi2_at_floor.add(std::abs(*score.chi2_after - 1.0) <= 0.1);
}

void note_parameters(const TrialScore& score, Tally& tally) {
  for (const ParameterScore& p : score.parameters) {
    if (p.z) tally.z.push_back(*p.z);
    if (p.covered) tally.covered.add(*p.covered);
    if (p.z_nearest) tally.z_nearest.push_back(*p.z_nearest);
    if (p.covers_nearest) tally.covers_nearest.add(*p.covers_nearest);
  }
  for (const ParameterScore& p : score.needle) {
    if (p.z) tally.z_needle.push_back(*p.z);
    if (p.covered) tally.needle_covered.add(*p.covered);
  }
  for (const LocationScore& location : score.locations) {
    (location.in_seconds ? tally.location_errors_s : tally.location_errors_mm).push_back(location.error);
    tally.located.add(location.error <= (location.in_seconds ? 0.2 : 3.0));
  }
}

void note_reliability(const TrialScore& score, Tally& tally) {
  tally.truth_improbable.add(score.probability_of_truth < 0.01);
  auto bin = tally.reliability.end();
  do --bin;
  while (bin != tally.reliability.begin() && score.probability_of_said < bin->low);
  bin->mean += score.probability_of_said;  // a sum until all are in
  bin->right.add(score.strict);
}

void finish_reliability(Tally& tally) {
  int all = 0;
  for (ReliabilityBin& bin : tally.reliability) {
    if (bin.right.of == 0) continue;
    bin.mean /= bin.right.of;
    all += bin.right.of;
    tally.expected_calibration_error += bin.right.of * std::abs(bin.mean - bin.right.value());
  }
  if (all > 0) tally.expected_calibration_error /= all;
}

std::pair<double, double> mean_and_spread(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, values.size() > 1 ? std::sqrt(squares / static_cast<double>(values.size() - 1)) : 0.0};
}

}  // namespace

Tally tally(const std::vector<TrialScore>& scores) {
  Tally t;
  const std::vector<double> edges{0, 2, 5, 8, 15, 30, 100, std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) t.sensitivity.push_back({edges[i], edges[i + 1], {}, {}});
  for (const double low : {0.0, 0.5, 0.7, 0.9, 0.97}) t.reliability.push_back({.low = low, .right = {}});
  for (const TrialScore& score : scores) {
    ++t.trials;
    note_shares(score, t);
    note_sensitivity(score, t);
    if (score.seconds > 0) t.seconds.push_back(score.seconds);
    if (score.abstained) {
      ++t.abstentions;
      continue;
    }
    t.mean_probability_of_truth += score.probability_of_truth;
    note_reliability(score, t);
    confuse(score, t);
    note_fit(score, t);
    note_parameters(score, t);
  }
  if (t.trials > 0) t.mean_probability_of_truth /= t.trials;
  finish_reliability(t);
  std::tie(t.z_mean, t.z_spread) = mean_and_spread(t.z);
  std::tie(t.z_nearest_mean, t.z_nearest_spread) = mean_and_spread(t.z_nearest);
  std::tie(t.z_needle_mean, t.z_needle_spread) = mean_and_spread(t.z_needle);
  std::ranges::sort(t.seconds);
  return t;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

}  // namespace bevel::proof
