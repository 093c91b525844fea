#include "io/model_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

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

EffectEntry read_effect(Section section) {
  EffectEntry effect;
  section.read("name", effect.name, required);
  const auto& known = known_effect_names();
  if (!effect.name.empty() && std::find(known.begin(), known.end(), effect.name) == known.end()) {
    section.fail_unknown("name", "effect", effect.name, known);
  }
  effect.parameters = section.read_remaining_numbers();
  return effect;
}

ModelFile read_model(ConfigFile file) {
  ModelFile model;
  model.needle = read_needle(file.section("needle", required));
  for (const Section& section : file.sections("effect", optional)) model.effects.push_back(read_effect(section));
  file.finish();
  return model;
}

// TOML tells 20 from 20.0, and other readers may insist on the latter.
std::string toml_number(double value) {
  const std::string text = format_number(value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

}  // namespace

const std::vector<std::string>& known_effect_names() {
  static const std::vector<std::string> names{"rotation_backlash",
                                              "torsional_windup",
                                              "insertion_backlash",
                                              "insertion_scale",
                                              "lost_steps",
                                              "rate_dependence",
                                              "layer",
                                              "depth_dependence",
                                              "drilling",
                                              "flip_transient",
                                              "relaxation",
                                              "puncture",
                                              "tissue_motion",
                                              "lateral_bias",
                                              "bevel_offset",
                                              "entry_angle",
                                              "camera_latency",
                                              "camera_scale",
                                              "camera_rotation",
                                              "refraction",
                                              "slip_direction"};
  return names;
}

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
    for (const auto& [key, value] : effect.parameters) text += key + " = " + toml_number(value) + "\n";
  }
  return text;
}

void save_model_file(const ModelFile& model, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file << to_toml(model);
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written: " + std::strerror(errno));
}

}  // namespace bevel::io
