// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/mismatch/effect_source.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace bevel::diagnosis {

using inference::Form;

namespace {

constexpr double kStepShare =
    0.02;  // of the covariate's range: the width of a step, without which no fit could move it

constexpr const char* kSource = R"(// Proposed by bevel-diagnose for a discrepancy:
//   @meaning@,
//   v = @equation@, x: @covariate@, from @low@ to @high@ in the recordings,
//   a = @a@, standard error @a_sd@ @component_unit@; s = @s@@s95@;
//   log Bayes factor against all curves @factor@ (below zero the curve does better).
// About as it was found, in a model file; with the effect in the library bevel-diagnose fits it:
//   [[effect]]
//   name = "@name@"
@found@//
// It does what the discrepancy did and is no cause: say in `meaning` what is going on in the rig, let `reported` and
// the bounds be of that, and test it against a closed form.
//
// This file is model/src/effects/@name@.cpp. In model/src/effects/registry.cpp its line
// stands above the last one, EFFECT(camera_latency): discrepancies act after all effects that move the tip.
//   EFFECT(@name@)
@includes@#include <bevel/model/effects/component_effect.hpp>

namespace bevel::model {
namespace {

class @class@ final : public ComponentEffect {
 public:
  @class@()
      : ComponentEffect(DiscrepancyComponent::@component@,
                        {.name = "@name@",
                         .meaning = "@meaning@",
                         .covariate = Covariate::@covariate@,
                         .parameters = {@parameters@}}) {}

 protected:
  Dual value_at(Parameters p, double place_@unit@) const override {
@value@  }
@constants@};

}  // namespace

const Effect& @name@() {
  static const @class@ effect;
  return effect;
}

}  // namespace bevel::model
)";

constexpr const char* kAmplitude = R"({.name = "amplitude_@component_unit_in_name@",
                                         .lower = @lower@,
                                         .upper = @upper@,
                                         .none = 0,
                                         .starts = {@start@},
                                         .reported = @reported@})";
constexpr const char* kShape = R"(,
                                        {.name = "@shape@",
                                         .lower = @lower@,
                                         .upper = @upper@,
                                         .none = kNoNone,
                                         .starts = {@starts@},
                                         .likely_low = @likely_low@,
                                         .likely_high = @likely_high@})";
constexpr const char* kPhase = R"(,
                                        {.name = "phase_rad",
                                         .lower = 0,
                                         .upper = 2 * std::numbers::pi,
                                         .none = kNoNone,
                                         .starts = {0, 1.05, 2.09, 3.14, 4.19, 5.24},
                                         .periodic = true})";

constexpr const char* kStep = R"(    const Dual beyond_@unit@ = place_@unit@ - p[1];
    return p[0] * clamp(beyond_@unit@ / kWidth_@unit@ + 0.5, 0, 1);
)";
constexpr const char* kRamp = R"(    const Dual beyond_@unit@ = place_@unit@ - p[1];
    return beyond_@unit@.value > 0 ? p[0] * beyond_@unit@ / kRange_@unit@ : Dual();
)";
constexpr const char* kPower = R"(    const double share = std::max(0.0, place_@unit@ - kLow_@unit@) / kRange_@unit@;
    return p[0] * pow(share, p[1]);
)";
constexpr const char* kExponential = R"(    const double along_@unit@ = std::max(0.0, place_@unit@ - kLow_@unit@);
    return p[0] * exp(-along_@unit@ / p[1]);
)";
constexpr const char* kSaturation = R"(    const double along_@unit@ = std::max(0.0, place_@unit@ - kLow_@unit@);
    return p[0] * (1.0 - exp(-along_@unit@ / p[1]));
)";
constexpr const char* kSinusoid = R"(    const Dual phase_rad = 2 * std::numbers::pi * place_@unit@ / p[1] + p[2];
    return p[0] * sin(phase_rad);
)";
// Round a circle it has to close: its period is no parameter.
constexpr const char* kClosedSinusoid =
    R"(    const Dual phase_rad = 2 * std::numbers::pi * place_@unit@ / kPeriod_@unit@ + p[1];
    return p[0] * sin(phase_rad);
)";

// Every @key@ of the text replaced, in the order of the list: values may hold keys of later ones.
using Words = std::vector<std::pair<const char*, std::string>>;
std::string filled(std::string text, const Words& words) {
  for (const auto& [key, value] : words) {
    const std::string mark = "@" + std::string(key) + "@";
    for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += value.size())
      text.replace(at, mark.size(), value);
  }
  return text;
}

std::string number(double value, int digits = 6) {
  char out[48];
  std::snprintf(out, sizeof out, "%.*g", digits, value);
  return out;
}

struct CovariateWords {
  std::string name, unit, phrase;
};
CovariateWords words_of(model::Covariate covariate) {
  switch (covariate) {
    case model::Covariate::time_s:
      return {"time", "s", "time"};
    case model::Covariate::depth_mm:
      return {"depth", "mm", "depth"};
    case model::Covariate::speed_mm_s:
      return {"speed", "mm_s", "speed"};
    case model::Covariate::turn_rate_rad_s:
      return {"turn_rate", "rad_s", "the rate of turning"};
    case model::Covariate::since_stop_s:
      return {"since_stop", "s", "the time since a stop"};
    case model::Covariate::since_reversal_mm:
      return {"since_reversal", "mm", "the depth since the last turn"};
    case model::Covariate::turned_rad:
      return {"turned", "rad", "the turning since the entry"};
    case model::Covariate::withdrawn_mm:
      return {"withdrawn", "mm", "how far the needle is drawn back"};
    case model::Covariate::tip_x_mm:
      return {"tip_x", "mm", "where the tip is along x"};
    case model::Covariate::tip_y_mm:
      return {"tip_y", "mm", "where the tip is along y"};
    case model::Covariate::tip_xy_mm:
      return {"tip_xy", "mm", "where the tip is between x and y"};
    case model::Covariate::tip_yx_mm:
      return {"tip_yx", "mm", "where the tip is between y and minus x"};
    case model::Covariate::since_speed_change_s:
      return {"since_speed_change", "s", "the time since a change of speed"};
    case model::Covariate::roll_rad:
      return {"roll", "rad", "roll"};
  }
  return {};
}

// "1/mm" is "per_mm" in a name, "mm per rad" is "mm_per_rad", "mm/s" is "mm_s".
std::string in_name(std::string_view of) {
  std::string unit(of);
  if (unit.starts_with("1/")) unit.replace(0, 2, "per ");
  std::replace(unit.begin(), unit.end(), '/', '_');
  std::replace(unit.begin(), unit.end(), ' ', '_');
  return unit;
}

std::string name_of_effect(const ProposedForm& p) {
  std::string name = p.component >= model::DiscrepancyComponent::x ? "reading_" : "";
  name +=
      std::string(info_of(p.component).name) + "_" + std::string(name_of(p.form)) + "_by_" + words_of(p.covariate).name;
  std::string free = name;  // one of that name may have been proposed, and taken up, before
  for (int i = 2; model::find_effect(free) != nullptr; ++i) free = name + "_" + std::to_string(i);
  return free;
}

std::string name_of_class(const std::string& effect) {
  std::string out;
  bool first = true;
  for (const char c : effect) {
    if (c != '_') out += first ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    first = c == '_';
  }
  return out;
}

std::string name_of_shape(const ProposedForm& p, const std::string& unit) {
  return p.form == Form::power ? "exponent" : "shape_" + unit;
}

std::string parameters_of(const ProposedForm& p, const std::string& unit) {
  const auto& info = info_of(p.component);
  const bool swings = p.form == Form::sinusoid;  // half a turn of its phase is its other sign
  const double amplitude = swings ? std::abs(p.amplitude) : p.amplitude;
  std::string out = filled(kAmplitude, {{"component_unit_in_name", in_name(unit_of(p.component, p.covariate))},
                                        {"lower", number(swings ? 0 : -info.largest)},
                                        {"upper", number(info.largest)},
                                        {"start", number(amplitude, 3)},
                                        {"reported", number(std::abs(amplitude), 3)}});
  if (!p.periodic) {
    const auto [least, most] = std::minmax_element(p.shapes.begin(), p.shapes.end());
    const bool is_place = p.form == Form::step || p.form == Form::ramp;
    std::string starts;
    for (const double one : p.shapes) starts += (starts.empty() ? "" : ", ") + number(one, 4);
    out += filled(kShape, {{"shape", name_of_shape(p, unit)},
                           {"lower", number(is_place ? p.low : 0.5 * *least)},
                           {"upper", number(is_place ? p.low + p.range : 2 * *most)},
                           {"starts", starts},
                           {"likely_low", number(is_place ? p.low : *least)},
                           {"likely_high", number(is_place ? p.low + p.range : *most)}});
  }
  return swings ? out + kPhase : out;
}

// The lines of a model file.
std::string found_of(const ProposedForm& p, const std::string& unit) {
  const auto line = [](const std::string& name, double value) { return "//   " + name + " = " + number(value) + "\n"; };
  const bool swings = p.form == Form::sinusoid;
  std::string out =
      line("amplitude_" + in_name(unit_of(p.component, p.covariate)), swings ? std::abs(p.amplitude) : p.amplitude);
  if (!p.periodic) out += line(name_of_shape(p, unit), p.shape);
  if (swings) out += line("phase_rad", p.phase_rad + (p.amplitude < 0 ? std::numbers::pi : 0));
  return out;
}

std::string constants_of(const ProposedForm& p, const std::string& unit) {
  const auto written = [&](const char* name, const std::string& value) {
    return "  static constexpr double " + std::string(name) + "_" + unit + " = " + value + ";\n";
  };
  const auto constant = [&](const char* name, double value) { return written(name, number(value)); };
  switch (p.form) {
    case Form::step:
      // Where only tenths of a second are looked at, from one to the next: narrower, none would say where it is.
      return constant("kWidth", adds_up(p.covariate) ? model::kSpeedChange_s : kStepShare * p.range);
    case Form::ramp:
      return constant("kRange", p.range);
    case Form::power:
      return constant("kLow", p.low) + constant("kRange", p.range);
    case Form::exponential:
    case Form::saturation:
      return constant("kLow", p.low);
    case Form::sinusoid:
      // Over many turns a period that is rounded would be another.
      return p.periodic ? written("kPeriod", "2 * std::numbers::pi / " + number(2 * std::numbers::pi / p.shape)) : "";
  }
  return "";
}

std::string includes_of(Form form) {
  if (form == Form::sinusoid) return "#include <numbers>\n\n";
  return form == Form::step || form == Form::ramp ? "" : "#include <algorithm>\n\n";
}

const char* value_of(const ProposedForm& p) {
  switch (p.form) {
    case Form::step:
      return kStep;
    case Form::ramp:
      return kRamp;
    case Form::power:
      return kPower;
    case Form::exponential:
      return kExponential;
    case Form::saturation:
      return kSaturation;
    case Form::sinusoid:
      return p.periodic ? kClosedSinusoid : kSinusoid;
  }
  return "";
}

}  // namespace

EffectSource effect_source(const ProposedForm& p) {
  const auto& info = info_of(p.component);
  const std::string name = name_of_effect(p);
  const CovariateWords covariate = words_of(p.covariate);
  const std::string constants = constants_of(p, covariate.unit);
  const std::string s95 = p.shape_low < p.shape_high
                              ? ", 95 % " + number(p.shape_low, 3) + " to " + number(p.shape_high, 3)
                              : std::string();
  return {name, filled(kSource, {{"includes", includes_of(p.form)},
                                 {"value", value_of(p)},
                                 {"constants", constants.empty() ? "" : "\n private:\n" + constants},
                                 {"parameters", parameters_of(p, covariate.unit)},
                                 {"found", found_of(p, covariate.unit)},
                                 {"meaning", std::string(info.meaning) + " is off by a" +
                                                 (p.form == Form::exponential ? "n " : " ") +
                                                 std::string(name_of(p.form)) + " over " + covariate.phrase},
                                 {"equation", p.equation},
                                 {"covariate", std::string(model::name_of(p.covariate))},
                                 {"low", number(p.low, 3)},
                                 {"high", number(p.low + p.range, 3)},
                                 {"a", number(p.amplitude, 3)},
                                 {"a_sd", number(p.amplitude_sd, 2)},
                                 {"s", number(p.shape, 3)},
                                 {"s95", s95},
                                 {"component_unit", std::string(unit_of(p.component, p.covariate))},
                                 {"component", std::string(info.name)},
                                 {"factor", number(p.log_bayes_factor, 3)},
                                 {"unit", covariate.unit},
                                 {"class", name_of_class(name)},
                                 {"name", name}})};
}

const ProposedForm* proposed_form(const Findings& findings) {
  if (findings.verdict != Verdict::unknown_effect || findings.proposals.empty()) return nullptr;
  // Of the discrepancy that shows most: a small one beside it may follow its form as well.
  const auto rank = [&](const ProposedForm& one) {
    return std::pair(findings.discrepancies.at(one.discrepancy).visible_size, one.log_bayes_factor);
  };
  return &*std::ranges::max_element(findings.proposals, {}, rank);
}

std::optional<EffectSource> proposed_effect(const Findings& findings) {
  const ProposedForm* form = proposed_form(findings);
  return form ? std::optional(effect_source(*form)) : std::nullopt;
}

}  // namespace bevel::diagnosis
