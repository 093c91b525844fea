// SPDX-License-Identifier: MIT
#include <bevel/io/model_uncertainty.hpp>

#include "toml_text.hpp"

namespace bevel::io {
namespace {

// A list of names and what each stands for; an unknown name is answered with all of them.
template <class Value>
bool read_name(Section& section, std::string_view key, const Choices<Value>& choices, Value& value) {
  std::string given;
  section.read(key, given, required);
  if (given.empty()) {
    if (section.has(key)) section.fail(key, "is empty; a " + std::string(key) + " is wanted");
    return false;
  }
  std::vector<std::string> names;
  for (const auto& [name, choice] : choices) {
    if (name == given) {
      value = choice;
      return true;
    }
    names.push_back(name);
  }
  section.fail_unknown(key, key, given, names);
  return false;
}

Choices<model::DiscrepancyComponent> components() {
  Choices<model::DiscrepancyComponent> out;
  for (const auto& info : model::discrepancy_components()) out.emplace_back(info.name, info.component);
  return out;
}

Choices<model::Covariate> covariates() {
  Choices<model::Covariate> out;
  for (const model::Covariate covariate : model::all_covariates())
    out.emplace_back(model::name_of(covariate), covariate);
  return out;
}

model::DiscrepancyCurve read_discrepancy(Section section) {
  model::DiscrepancyCurve curve;
  bool whole = read_name(section, "component", components(), curve.component);
  whole &= read_name(section, "covariate", covariates(), curve.covariate);
  curve.periodic = curve.covariate == model::Covariate::roll_rad;
  section.read("periodic", curve.periodic, optional);
  const double largest = model::info_of(curve.component).largest;
  const Range size = in_range(1, static_cast<double>(model::kMaxKnots));
  section.read("knots", curve.at, required, {}, size);
  section.read("values", curve.values, required, in_range(-largest, largest), size);
  section.read("std_errors", curve.std_errors, required, in_range(0, largest), size);
  // After a fault of one list the others' lengths say nothing.
  whole &= !curve.at.empty() && !curve.values.empty() && !curve.std_errors.empty();
  if (const std::string fault = whole ? find_fault(curve) : ""; !fault.empty()) section.fail("", fault);
  return curve;
}

}  // namespace

std::vector<model::DiscrepancyCurve> read_discrepancies(Section parent, std::size_t effects) {
  std::vector<model::DiscrepancyCurve> curves;
  for (const Section& section : parent.sections("discrepancy", optional)) curves.push_back(read_discrepancy(section));
  if (!curves.empty() && effects <= model::kMaxEffects && effects + curves.size() > model::kMaxEffects)
    parent.fail("discrepancy", "there are " + std::to_string(curves.size()) + " beside " + std::to_string(effects) +
                                   " effects; at most " + std::to_string(model::kMaxEffects) + " are allowed together");
  return curves;
}

std::optional<model::Variation> read_variation(Section parent) {
  Section section = parent.section("variation", optional);
  if (!section.present()) return std::nullopt;
  model::Variation out;
  constexpr auto kMost = model::kLargestVariation;
  section.read("curvature_relative", out.curvature_relative, optional, in_range(0, kMost.curvature_relative));
  section.read("entry_angle_rad", out.entry_angle_rad, optional, in_range(0, kMost.entry_angle_rad));
  section.read("entry_point_mm", out.entry_point_mm, optional, in_range(0, kMost.entry_point_mm));
  section.read("roll_rad", out.roll_rad, optional, in_range(0, kMost.roll_rad));
  return out;
}

std::string to_toml(const model::DiscrepancyCurve& curve) {
  std::string text = "[[discrepancy]]\n";
  text += "component = " + toml_text(model::info_of(curve.component).name) + "\n";
  text += "covariate = " + toml_text(model::name_of(curve.covariate)) + "\n";
  if (curve.periodic != (curve.covariate == model::Covariate::roll_rad))
    text += std::string("periodic = ") + (curve.periodic ? "true" : "false") + "\n";
  text += "knots = " + toml_array(curve.at) + "\n";
  text += "values = " + toml_array(curve.values) + "\n";
  text += "std_errors = " + toml_array(curve.std_errors) + "\n";
  return text;
}

std::string to_toml(const model::Variation& variation) {
  std::string text = "[variation]\n";
  text += "curvature_relative = " + toml_number(variation.curvature_relative) + "\n";
  text += "entry_angle_rad = " + toml_number(variation.entry_angle_rad) + "\n";
  text += "entry_point_mm = " + toml_number(variation.entry_point_mm) + "\n";
  text += "roll_rad = " + toml_number(variation.roll_rad) + "\n";
  return text;
}

}  // namespace bevel::io
