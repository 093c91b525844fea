// SPDX-License-Identifier: MIT
#include <bevel/io/model_file.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include <bevel/error.hpp>
#include <bevel/io/result_file.hpp>
#include "toml_text.hpp"

namespace bevel::io {
namespace {

const Choices<model::SlipDirection> kSlipChoices{{"isotropic", model::SlipDirection::isotropic},
                                                 {"bevel-plane", model::SlipDirection::bevel_plane}};
const Choices<model::FrontWheel> kFrontWheelChoices{{"published", model::FrontWheel::published},
                                                    {"nonslip", model::FrontWheel::nonslip}};

template <class Enum>
std::string name_in(const Choices<Enum>& choices, Enum value) {
  return std::find_if(choices.begin(), choices.end(), [value](const auto& choice) { return choice.second == value; })
      ->first;
}

std::vector<std::string> known_effect_names() {
  std::vector<std::string> names;
  for (const model::Effect* effect : model::all_effects()) names.emplace_back(effect->name());
  return names;
}

void read_parameter(Section& section, const model::EffectParameter& parameter, Presence presence,
                    std::map<std::string, double>& values) {
  double value = std::numeric_limits<double>::quiet_NaN();
  section.read(parameter.name, value, presence, in_range(parameter.lower, parameter.upper));
  if (std::isfinite(value)) values.emplace(parameter.name, value);
}

// An effect at whose every size it vanishes says nothing: that is a parameter forgotten.
void refuse_empty(Section& section, const model::Effect& effect) {
  std::string sizes;
  for (const auto& parameter : effect.parameters()) {
    if (parameter.scope == model::Scope::recording || std::isnan(parameter.none)) continue;
    if (section.has(parameter.name)) return;
    sizes += (sizes.empty() ? "" : " or ") + std::string(parameter.name);
  }
  if (!sizes.empty()) section.fail("", std::string(effect.name()) + " has no size; " + sizes + " is required");
}

EffectEntry read_effect(Section section) {
  EffectEntry entry;
  section.read("name", entry.name, required);
  const model::Effect* effect = model::find_effect(entry.name);
  if (effect == nullptr) {
    if (!entry.name.empty()) section.fail_unknown("name", "effect", entry.name, known_effect_names());
    section.read_remaining_numbers();  // whose keys these are nobody knows: one fault is enough
    return entry;
  }
  bool by_recording = false;
  for (const auto& parameter : effect->parameters()) {
    const bool of_recording = parameter.scope == model::Scope::recording;
    by_recording |= of_recording;
    const bool needed = !of_recording && std::isnan(parameter.none) && std::isnan(parameter.usual);
    read_parameter(section, parameter, needed ? required : optional, entry.parameters);
  }
  refuse_empty(section, *effect);
  if (!by_recording) return entry;
  Section recordings = section.section("recordings", optional);
  for (Section& recording : recordings.children()) {
    auto& values = entry.recordings[recording.path().substr(recordings.path().size() + 1)];
    for (const auto& parameter : effect->parameters())
      if (parameter.scope == model::Scope::recording) read_parameter(recording, parameter, optional, values);
  }
  return entry;
}

ModelFile read_model(ConfigFile file) {
  ModelFile model;
  model.needle = read_needle(file.section("needle", required));
  model.effects = read_effects(file.root());
  model.discrepancies = read_discrepancies(file.root(), model.effects.size());
  model.variation = read_variation(file.root());
  file.finish();
  return model;
}

std::string toml_numbers(const std::map<std::string, double>& values) {
  std::string text;
  for (const auto& [key, value] : values) text += key + " = " + toml_number(value) + "\n";
  return text;
}

}  // namespace

model::NeedleParameters read_needle(Section section) {
  model::NeedleParameters needle;
  section.read("curvature_per_mm", needle.curvature_per_mm, required, in_range(-0.05, 0.05));
  section.read("wheelbase_mm", needle.wheelbase_mm, required, in_range(1.0, 1000.0));
  section.read("lambda1_per_rad", needle.lambda1_per_rad, required);
  section.read("lambda2", needle.lambda2, required);
  section.read("slip", needle.slip, optional, kSlipChoices);
  section.read("front_wheel", needle.front_wheel, optional, kFrontWheelChoices);
  if (const auto violation = model::find_domain_violation(needle)) section.fail("", model::describe(*violation));
  return needle;
}

std::vector<EffectEntry> read_effects(Section parent) {
  std::vector<EffectEntry> effects;
  for (const Section& section : parent.sections("effect", optional)) effects.push_back(read_effect(section));
  if (effects.size() > model::kMaxEffects)
    parent.fail("effect", "there are " + std::to_string(effects.size()) + "; at most " +
                              std::to_string(model::kMaxEffects) + " are allowed");
  return effects;
}

// A recording is named by its log's file name, and where several logs of a case have one name, by the folders before it
// as well: of the names that end the recording's path the longest is meant. end() if there is none.
auto find_recording(const std::map<std::string, std::map<std::string, double>>& recordings, std::string_view path) {
  auto found = recordings.end();
  for (auto one = recordings.begin(); one != recordings.end(); ++one) {
    const std::string& name = one->first;
    if (!path.ends_with(name) || (path.size() > name.size() && path[path.size() - name.size() - 1] != '/')) continue;
    if (found == recordings.end() || name.size() > found->first.size()) found = one;
  }
  return found;
}

std::vector<model::ActiveEffect> active_effects(const std::vector<EffectEntry>& effects,
                                                std::string_view recording_name) {
  // Given from the folder that the log is in, the folders before it are not in the name.
  const std::string recording =
      recording_name.empty() ? "" : std::filesystem::absolute(recording_name).lexically_normal().string();
  std::vector<model::ActiveEffect> active;
  for (const auto& entry : effects) {
    model::ActiveEffect one{.effect = model::find_effect(entry.name), .parameters = {}};
    if (one.effect == nullptr) throw ArgumentError("there is no effect \"" + entry.name + "\"");
    std::map<std::string, double> values;
    if (const auto own = find_recording(entry.recordings, recording); own != entry.recordings.end())
      values = own->second;
    values.insert(entry.parameters.begin(), entry.parameters.end());  // the recording's own come first
    for (std::size_t i = 0; const auto& parameter : one.effect->parameters()) {
      const auto given = values.extract(std::string(parameter.name));
      const double otherwise = model::value_if_unsaid(parameter);
      one.parameters[i++] = given.empty() ? otherwise : given.mapped();
      if (given.empty() && std::isnan(otherwise))
        throw ArgumentError(entry.name + "." + std::string(parameter.name) + " is missing and is required");
    }
    if (!values.empty()) throw ArgumentError(entry.name + " has no parameter \"" + values.begin()->first + "\"");
    active.push_back(one);
  }
  return active;
}

std::vector<model::ActiveEffect> active_effects(const std::vector<EffectEntry>& effects,
                                                const std::vector<model::DiscrepancyCurve>& discrepancies,
                                                std::string_view recording_name) {
  auto active = active_effects(effects, recording_name);
  for (const auto& curve : discrepancies) active.push_back(model::active_discrepancy(curve));
  return active;
}

std::vector<model::ActiveEffect> active_effects(const ModelFile& model, std::string_view recording_name) {
  return active_effects(model.effects, model.discrepancies, recording_name);
}

ModelFile load_model_file(const std::string& path) { return read_model(ConfigFile::load(path)); }

ModelFile parse_model_file(std::string_view text, const std::string& name) {
  return read_model(ConfigFile::parse(text, name));
}

std::string to_toml(const ModelFile& model) {
  const auto& needle = model.needle;
  std::string text = "[needle]\n";
  text += "curvature_per_mm = " + toml_number(needle.curvature_per_mm) + "\n";
  text += "wheelbase_mm = " + toml_number(needle.wheelbase_mm) + "\n";
  text += "lambda1_per_rad = " + toml_number(needle.lambda1_per_rad) + "\n";
  text += "lambda2 = " + toml_number(needle.lambda2) + "\n";
  text += "slip = \"" + name_in(kSlipChoices, needle.slip) + "\"\n";
  text += "front_wheel = \"" + name_in(kFrontWheelChoices, needle.front_wheel) + "\"\n";
  for (const auto& effect : model.effects) {
    text += "\n[[effect]]\nname = \"" + effect.name + "\"\n";
    text += toml_numbers(effect.parameters);
    for (const auto& [recording, values] : effect.recordings)
      text += "[effect.recordings." + toml_text(recording) + "]\n" + toml_numbers(values);
  }
  for (const auto& curve : model.discrepancies) text += "\n" + to_toml(curve);
  if (model.variation) text += "\n" + to_toml(*model.variation);
  return text;
}

void save_model_file(const ModelFile& model, const std::string& path) { write_result_file(path, to_toml(model)); }

}  // namespace bevel::io
