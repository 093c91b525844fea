// SPDX-License-Identifier: MIT
// Scores and their tally as JSON: score.json of each trial, results.json of all.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "proof/tally.hpp"

namespace bevel::proof {

using nlohmann::json;

namespace {

template <class T>
json optional_json(const std::optional<T>& value) {
  return value ? json(*value) : json(nullptr);
}

std::optional<double> optional_number(const json& j, const char* key) {
  return j.contains(key) && j.at(key).is_number() ? std::optional(j.at(key).get<double>()) : std::nullopt;
}

json share_json(const Share& share) {
  const Interval w = wilson95(share);
  return {{"hits", share.hits}, {"of", share.of}, {"share", share.value()}, {"wilson95", {w.low, w.high}}};
}

json shares_json(const std::map<std::string, Share>& shares) {
  json j = json::object();
  for (const auto& [name, share] : shares) j[name] = share_json(share);
  return j;
}

Visibility visibility_of(const std::string& name) {
  for (const Visibility v : {Visibility::null, Visibility::invisible, Visibility::partly})
    if (name == name_of(v)) return v;
  return Visibility::visible;
}

json spread_json(const std::vector<double>& values) {
  if (values.empty()) return {{"count", 0}};
  return {{"count", values.size()},
          {"median", median(values)},
          {"largest", *std::ranges::max_element(values)},
          {"smallest", *std::ranges::min_element(values)}};
}

}  // namespace

json as_json(const TrialScore& s) {
  json j{{"trial", s.trial},
         {"class", s.trial_class},
         {"plant", s.plant},
         {"visibility", name_of(s.visibility)},
         {"visible_sigmas", s.visible_sigmas},
         {"expected", s.expected},
         {"concealed", s.concealed},
         {"named", s.named},
         {"rivals", s.rivals},
         {"abstained", s.abstained},
         {"abstention", s.abstention},
         {"strict", s.strict},
         {"lenient", s.lenient},
         {"probability_of_truth", s.probability_of_truth},
         {"probability_of_said", s.probability_of_said},
         {"chi2_before", optional_json(s.chi2_before)},
         {"chi2_after", optional_json(s.chi2_after)},
         {"rmse_before_mm", optional_json(s.rmse_before_mm)},
         {"rmse_after_mm", optional_json(s.rmse_after_mm)},
         {"log_density_before", optional_json(s.log_density_before)},
         {"log_density_after", optional_json(s.log_density_after)},
         {"seconds", s.seconds},
         {"found", json::array()},
         {"parameters", json::array()},
         {"needle", json::array()},
         {"locations", json::array()}};
  for (const FoundEffect& f : s.found)
    j["found"].push_back({{"name", f.name}, {"visible_sigmas", f.visible_sigmas}, {"named", f.named}});
  for (const ParameterScore& p : s.parameters)
    j["parameters"].push_back({{"effect", p.effect},
                               {"parameter", p.parameter},
                               {"truth", p.truth},
                               {"value", p.value},
                               {"z", optional_json(p.z)},
                               {"covered", optional_json(p.covered)},
                               {"z_nearest", optional_json(p.z_nearest)},
                               {"covers_nearest", optional_json(p.covers_nearest)}});
  for (const ParameterScore& p : s.needle)
    j["needle"].push_back({{"parameter", p.parameter},
                           {"truth", p.truth},
                           {"value", p.value},
                           {"z", optional_json(p.z)},
                           {"covered", optional_json(p.covered)}});
  for (const LocationScore& l : s.locations)
    j["locations"].push_back({{"effect", l.effect}, {"error", l.error}, {"unit", l.in_seconds ? "s" : "mm"}});
  return j;
}

TrialScore trial_score_of(const json& j) {
  TrialScore s;
  s.trial = j.at("trial");
  s.trial_class = j.at("class");
  s.plant = j.at("plant");
  s.visibility = visibility_of(j.at("visibility"));
  s.visible_sigmas = j.at("visible_sigmas");
  s.expected = j.at("expected").get<std::vector<std::string>>();
  s.concealed = j.at("concealed").get<std::vector<std::string>>();
  s.named = j.at("named").get<std::vector<std::string>>();
  s.rivals = j.at("rivals").get<std::vector<std::string>>();
  s.abstained = j.at("abstained");
  s.abstention = j.at("abstention");
  s.strict = j.at("strict");
  s.lenient = j.at("lenient");
  s.probability_of_truth = j.at("probability_of_truth");
  s.probability_of_said = j.value("probability_of_said", 0.0);
  s.chi2_before = optional_number(j, "chi2_before");
  s.chi2_after = optional_number(j, "chi2_after");
  s.rmse_before_mm = optional_number(j, "rmse_before_mm");
  s.rmse_after_mm = optional_number(j, "rmse_after_mm");
  s.log_density_before = optional_number(j, "log_density_before");
  s.log_density_after = optional_number(j, "log_density_after");
  s.seconds = j.at("seconds");
  for (const json& f : j.at("found")) s.found.push_back({f.at("name"), f.at("visible_sigmas"), f.at("named")});
  for (const json& p : j.at("parameters")) {
    ParameterScore score{p.at("effect"), p.at("parameter"), p.at("truth"), p.at("value"), optional_number(p, "z"), {}};
    if (p.at("covered").is_boolean()) score.covered = p.at("covered").get<bool>();
    score.z_nearest = optional_number(p, "z_nearest");
    if (p.at("covers_nearest").is_boolean()) score.covers_nearest = p.at("covers_nearest").get<bool>();
    s.parameters.push_back(std::move(score));
  }
  for (const json& p : j.value("needle", json::array())) {
    s.needle.push_back({"needle", p.at("parameter"), p.at("truth"), p.at("value"), optional_number(p, "z"), {}});
    if (p.at("covered").is_boolean()) s.needle.back().covered = p.at("covered").get<bool>();
  }
  for (const json& l : j.at("locations")) s.locations.push_back({l.at("effect"), l.at("error"), l.at("unit") == "s"});
  return s;
}

json as_json(const Tally& t) {
  json reliability = json::array();
  for (const ReliabilityBin& bin : t.reliability)
    reliability.push_back({{"from", bin.low}, {"mean", bin.mean}, {"right", share_json(bin.right)}});
  json sensitivity = json::array();
  for (const SensitivityBin& bin : t.sensitivity)
    sensitivity.push_back({{"from_sigmas", bin.low_sigmas},
                           {"to_sigmas", std::isfinite(bin.high_sigmas) ? json(bin.high_sigmas) : json(nullptr)},
                           {"named", share_json(bin.named)},
                           {"alarmed", share_json(bin.alarmed)}});
  const Interval exact = clopper_pearson95(t.false_alarms);
  json false_alarms = share_json(t.false_alarms);
  false_alarms["clopper_pearson95"] = {exact.low, exact.high};
  false_alarms["upper95_one_sided"] = clopper_pearson_upper95(t.false_alarms);
  return {
      {"trials", t.trials},
      {"abstentions", t.abstentions},
      {"exact_set_strict", shares_json(t.strict)},
      {"exact_set_lenient", shares_json(t.lenient)},
      {"exact_set_strict_visible_by_class", shares_json(t.strict_by_class)},
      {"false_alarms_in_nulls", false_alarms},
      {"unknown_called_unknown", share_json(t.unknown_called_unknown)},
      {"unknown_called_unknown_without_rival", share_json(t.unknown_distinct)},
      {"unknown_called_without_cause", share_json(t.unknown_alarms)},
      {"unknown_likelier_held_out", share_json(t.unknown_likelier)},
      {"unknown_nearer_held_out", share_json(t.unknown_nearer)},
      {"mean_probability_of_truth", t.mean_probability_of_truth},
      {"truth_below_one_percent", share_json(t.truth_improbable)},
      {"reliability", reliability},
      {"expected_calibration_error", t.expected_calibration_error},
      {"sensitivity", sensitivity},
      {"confusion", t.confusion},
      {"z_scores", {{"count", t.z.size()}, {"mean", t.z_mean}, {"spread", t.z_spread}, {"values", t.z}}},
      {"coverage95", share_json(t.covered)},
      {"z_scores_of_nearest",
       {{"count", t.z_nearest.size()}, {"mean", t.z_nearest_mean}, {"spread", t.z_nearest_spread}}},
      {"coverage95_of_nearest", share_json(t.covers_nearest)},
      {"coverage95_of_needle", share_json(t.needle_covered)},
      {"z_scores_of_needle", {{"count", t.z_needle.size()}, {"mean", t.z_needle_mean}, {"spread", t.z_needle_spread}}},
      {"located_within_0.2_s_or_3_mm", share_json(t.located)},
      {"location_errors_s", t.location_errors_s},
      {"location_errors_mm", t.location_errors_mm},
      {"held_out_chi2_before", spread_json(t.chi2_before)},
      {"held_out_chi2_after", spread_json(t.chi2_after)},
      {"held_out_chi2_within_10_percent_of_one", share_json(t.chi2_at_floor)},
      {"seconds", spread_json(t.seconds)}};
}

}  // namespace bevel::proof
