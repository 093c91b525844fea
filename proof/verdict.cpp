// SPDX-License-Identifier: MIT
#include "proof/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include <bevel/error.hpp>

namespace bevel::proof {

using nlohmann::json;

namespace {

[[noreturn]] void fail(const std::string& what) { throw ParseError("verdict.json: " + what); }

std::optional<double> number(const json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || object.at(key).is_null()) return std::nullopt;
  if (!object.at(key).is_number()) fail(std::string(key) + " is " + object.at(key).dump() + ", not a number");
  return object.at(key).get<double>();
}

std::string text(const json& object, const char* key) {
  if (!object.contains(key) || object.at(key).is_null()) return "";
  if (!object.at(key).is_string()) fail(std::string(key) + " is " + object.at(key).dump() + ", not a string");
  return object.at(key).get<std::string>();
}

const json& list(const json& object, const char* key) {
  static const json none = json::array();
  if (!object.contains(key) || object.at(key).is_null()) return none;
  if (!object.at(key).is_array()) fail(std::string(key) + " is not a list");
  return object.at(key);
}

std::pair<std::optional<double>, std::optional<double>> pair_of(const json& object, const char* key) {
  const json& values = list(object, key);
  if (values.size() != 2 || !values[0].is_number() || !values[1].is_number()) return {};
  return {values[0].get<double>(), values[1].get<double>()};
}

// A parameter is {"value": ...}, or {"rec03.lcm": ...} where it differs between recordings.
void read_parameter(const std::string& name, const json& j, NamedEffect& effect) {
  if (j.is_number()) {
    effect.parameters[name].value = j.get<double>();
    return;
  }
  if (!j.is_object()) fail(effect.name + "." + name + " is " + j.dump() + ", not a number or an object");
  if (j.contains("value")) {
    Estimate estimate;
    const auto value = number(j, "value");
    if (!value || !std::isfinite(*value)) fail(effect.name + "." + name + " has no value");
    estimate.value = *value;
    estimate.std_error = number(j, "std_error");
    std::tie(estimate.low95, estimate.high95) = pair_of(j, "ci95");
    effect.parameters[name] = estimate;
    return;
  }
  if (name != "at_s") return;
  for (const auto& [log, of_log] : j.items()) {
    const auto at = of_log.is_number() ? std::optional(of_log.get<double>()) : number(of_log, "value");
    if (at) effect.at_s[std::filesystem::path(log).filename().string()] = *at;
  }
}

NamedEffect read_effect(const json& j) {
  if (!j.is_object()) fail("an effect is not an object");
  NamedEffect effect;
  effect.name = text(j, "name");
  if (effect.name.empty()) fail("an effect has no name");
  effect.probability = number(j, "probability").value_or(1.0);
  if (!(effect.probability >= 0.0 && effect.probability <= 1.0))
    fail(effect.name + " has the probability " + std::to_string(effect.probability) + ", allowed is 0 to 1");
  for (const json& other : list(j, "ambiguous_with")) {
    if (!other.is_string()) fail("ambiguous_with of " + effect.name + " holds " + other.dump());
    effect.ambiguous_with.push_back(other.get<std::string>());
  }
  if (j.contains("parameters") && j.at("parameters").is_object())
    for (const auto& [name, value] : j.at("parameters").items()) read_parameter(name, value, effect);
  // The form of the model file: effect.recordings."rec03.lcm".at_s
  if (j.contains("recordings") && j.at("recordings").is_object())
    for (const auto& [log, of_log] : j.at("recordings").items())
      if (of_log.is_object() && of_log.contains("at_s")) read_parameter("at_s", json{{log, of_log.at("at_s")}}, effect);
  return effect;
}

Location read_location(const json& j) {
  if (!j.is_object()) fail("an entry of where is not an object");
  Location location;
  location.log = std::filesystem::path(text(j, "log")).filename().string();
  location.from_s = number(j, "from_s");
  location.to_s = number(j, "to_s");
  location.covariate = text(j, "covariate");
  std::tie(location.range_low, location.range_high) = pair_of(j, "range");
  return location;
}

PosteriorGiven read_posterior(const json& j) {
  if (!j.is_object()) fail("posterior is not an object");
  PosteriorGiven posterior{.nothing_missing = number(j, "nothing_missing").value_or(0),
                           .discrepancy = number(j, "discrepancy").value_or(0),
                           .explanations = {}};
  for (const json& one : list(j, "explanations")) {
    if (!one.is_object()) fail("an explanation is not an object");
    Explanation explanation{.effects = {},
                            .probability = number(one, "probability").value_or(0),
                            .with_discrepancy = number(one, "with_discrepancy").value_or(0)};
    for (const json& effect : list(one, "effects")) {
      if (!effect.is_string()) fail("an explanation holds " + effect.dump());
      const auto label = effect.get<std::string>();
      explanation.effects.push_back(label.substr(0, label.find(" (")));  // of an effect in kinds, its name
    }
    std::ranges::sort(explanation.effects);
    posterior.explanations.push_back(std::move(explanation));
  }
  return posterior;
}

std::map<std::string, Estimate> read_needle(const json& j) {
  std::map<std::string, Estimate> out;
  if (!j.is_object() || !j.contains("after") || !j.at("after").is_object()) return out;
  for (const auto& [name, of_one] : j.at("after").items())
    if (const auto value = of_one.is_object() ? number(of_one, "value") : std::nullopt) {
      out[name].value = *value;
      out[name].std_error = number(of_one, "std_error");
    }
  return out;
}

}  // namespace

std::vector<std::string> Verdict::named() const {
  std::set<std::string> names;
  for (const NamedEffect& effect : effects) names.insert(effect.name);
  if (kind == "unknown-effect") names.insert("unknown");
  return {names.begin(), names.end()};
}

Verdict parse_verdict(std::string_view text_of_file) {
  const json j = json::parse(text_of_file, nullptr, false);
  if (j.is_discarded() || !j.is_object()) fail("not a JSON object");
  Verdict verdict;
  verdict.kind = text(j, "verdict");
  // Of two groups the same is said of the change.
  const std::map<std::string, std::string> of_groups{
      {"unchanged", "nothing-missing"}, {"changed", "effects-found"}, {"changed-unknown", "unknown-effect"}};
  if (const auto same = of_groups.find(verdict.kind); same != of_groups.end()) verdict.kind = same->second;
  if (verdict.kind != "nothing-missing" && verdict.kind != "effects-found" && verdict.kind != "unknown-effect" &&
      verdict.kind != "inconclusive")
    fail("the verdict is \"" + verdict.kind +
         "\", allowed are nothing-missing, effects-found, unknown-effect, inconclusive; for two groups unchanged, "
         "changed, "
         "changed-unknown, inconclusive");
  for (const char* key : {"effects", "changes"})
    for (const json& effect : list(j, key)) verdict.effects.push_back(read_effect(effect));
  if (verdict.kind == "nothing-missing" && !verdict.effects.empty()) fail("nothing-missing, yet effects are named");
  if (verdict.kind == "inconclusive" && !verdict.effects.empty()) fail("inconclusive, yet effects are named");
  if (verdict.kind == "effects-found" && verdict.effects.empty()) fail("effects-found, yet none is named");
  for (const json& location : list(j, "where")) verdict.where.push_back(read_location(location));
  if (j.contains("needle")) verdict.needle = read_needle(j.at("needle"));
  if (j.contains("posterior")) verdict.posterior = read_posterior(j.at("posterior"));
  if (j.contains("fit") && j.at("fit").is_object()) {
    const json& fit = j.at("fit");
    const json none = json::object();
    const json& before = fit.contains("before") ? fit.at("before") : none;
    const json& after = fit.contains("after") ? fit.at("after") : none;
    verdict.chi2_before = number(before, "chi2_per_dof");
    verdict.chi2_after = number(after, "chi2_per_dof");
    verdict.rmse_before_mm = number(before, "rmse_mm");
    verdict.rmse_after_mm = number(after, "rmse_mm");
    verdict.log_density_before = number(before, "log_density");
    verdict.log_density_after = number(after, "log_density");
  }
  return verdict;
}

}  // namespace bevel::proof
